// The lips of a cut: the strip of the sheet beside it, as thick as the sheet and curled away from the cut. Pure.
//
// Across the contour, tissue to the left, at angle `a` of the curl:
//
//            .──.  free end: wall of the cut
//           (    )
//            \  /   curl: kCurl_m of tissue on an arc of a radius of kCurl_m / a
//   ──────────┘
//   I     sheet's surface +- half its thickness
//
// The sheet itself ends where the curl begins (kLipNearness): there membrane.frag and the ground truth of a data set
// show nothing of it. The flat part of the lip overlaps it. Between two cuts that are near each other, each lip has
// half of the tissue's width.
#pragma once

#include <array>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/cut_contour.h"
#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/sheet_place.h"
#include "services/base/core/sheet_heat.h"

namespace fulcrum::render {

inline constexpr float kCurl_m = 0.0009f;     ///< Width of the tissue that curls, in the sheet's own coordinates.
inline constexpr float kLipFlat_m = 0.0005f;  ///< Width of the flat part beside it.
/// Atlas::Nearness at which the curl begins; as in membrane.frag.
inline constexpr float kLipNearness = 1 - kCurl_m / Atlas::kRim_m;

/// False for the paper's picture as printed: it cuts no holes in the texture.
[[nodiscard]] inline bool DrawsCuts(const SceneView& scene) {
  return !(scene.thermal.model == ThermalModel::kPaper && scene.thermal.as == PaperForm::kPrinted);
}

/// What is drawn of cuts. coordinate: (s, t) [m], part, opacity.
struct CutGeometry {
  enum Part { kUpper, kWall, kUnderside, kStrand };
  std::vector<Vec3f> positions, normals;
  std::vector<std::array<float, 4>> coordinates;
  std::vector<Triangle> triangles;

  void Clear() {
    positions.clear();
    normals.clear();
    coordinates.clear();
    triangles.clear();
  }
  void Add(const Vec3f& position, const Vec3f& normal, const Vec2f& material, Part part, float opacity) {
    positions.push_back(position);
    normals.push_back(normal);
    coordinates.push_back({material.x(), material.y(), static_cast<float>(part), opacity});
  }
};

class CutLip {
 public:
  /// Keeps a reference to the arrays of `scene`.
  explicit CutLip(const SceneView& scene) : cols_(scene.membrane.cols), thickness_(ThicknessOfRows(scene)) {}

  /// Finds the lips anew, after a change of what is removed or of the topology. @pre places.SetTopology(mesh)
  void Find(const Atlas& atlas, const MembraneMesh& mesh, const SheetPlaces& places);
  /// Takes the curl from the damage beside the contours; false if it is as it was.
  bool Curl(const Atlas& atlas);
  /// Appends the lips as `mesh` lies. What is not finite, or stretched to more than kMostStretch times its width, is
  /// left out.
  void Append(const MembraneMesh& mesh, CutGeometry* out);
  static constexpr float kMostStretch = 4;

  [[nodiscard]] bool empty() const { return stations_.empty(); }
  [[nodiscard]] std::size_t station_count() const { return stations_.size(); }

 private:
  /// A cross-section.
  struct Station {
    SheetPlace edge, inner;
    ContourPoint at;
    float thickness_m = 0;
    float width_m = 0;  // Of curl and flat part.
    float curl_rad = 0;
    std::size_t next = 0;  // Of the contour; itself: none.
    bool drawn = false;
  };
  struct Section {
    Vec3f edge, inner;
    Vec2f material;                    // Of the inner border.
    Eigen::Matrix<float, 3, 2> frame;  // d(position)/d(s, t) beside the contour.
    bool valid = false;
  };
  void Place(const MembraneMesh& mesh);
  template <class Average>
  void Smooth(int passes, const Average& average);
  void AppendSection(const Station& station, const Section& section, const Vec3f& normal, CutGeometry* out) const;

  std::uint32_t cols_;
  std::vector<float> thickness_;
  std::vector<Station> stations_;
  std::vector<Section> sections_, before_;
};

}  // namespace fulcrum::render
