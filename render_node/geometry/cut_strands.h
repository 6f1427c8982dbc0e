// Strands of connective tissue that span a slit behind the hook, and what is left of them when they have broken. Pure.
//
// A strand belongs to a part of a cut triangle of the sheet: a hash of the triangle's number and the part's corners
// gives its place along the slit, its direction, thickness, length and the stretch at which it breaks. Whether it is
// broken follows from the present gap alone, so that a process that joins later shows the same.
#pragma once

#include <vector>

#include "render_node/geometry/cut_lip.h"

namespace fulcrum::render {

/// Number of strands per length of slit where nothing is burnt [1/m].
inline constexpr float kStrandsPerMetre = 3200;
/// Stretch at which the weakest and the strongest break.
inline constexpr float kWeakestStrand = 1.2f, kStrongestStrand = 2.2f;
/// Longest gap that a strand spans [m]: one across a slit that is held wide open looks like a suture.
inline constexpr float kLongestSpan_m = 0.005f;

class CutStrands {
 public:
  struct Strand {
    SheetPlace a, b;  ///< Where it is anchored, on either side of the slit.
    Vec2f material_a, material_b;
    float length_m;     ///< At rest.
    float breaks_at;    ///< Stretch.
    float thickness_m;  ///< At rest.
    float sag_m;        ///< Half thickness of the sheet: it is anchored at the underside.
    std::uint64_t hash;
  };

  /// Keeps a reference to the arrays of `scene`.
  explicit CutStrands(const SceneView& scene) : scene_(scene), thickness_(ThicknessOfRows(scene)) {}

  /// Finds the strands anew, after a change of what is removed or of the topology. @pre places.SetTopology(mesh)
  void Find(const Atlas& atlas, const MembraneMesh& mesh, const SheetPlaces& places);
  /// Appends ribbons that face the eye. @param pixels_per_rad of the picture: a ribbon is a pixel wide or more, and
  /// fades as far as its strand is thinner.
  void Append(const MembraneMesh& mesh, const Vec3f& eye_W, float pixels_per_rad, CutGeometry* out) const;

  [[nodiscard]] const std::vector<Strand>& strands() const { return strands_; }
  /// Stretch of a strand as `mesh` lies; below 1 it is slack.
  [[nodiscard]] static float StretchOf(const Strand& strand, const MembraneMesh& mesh) {
    return (strand.a.Of(mesh.positions()) - strand.b.Of(mesh.positions())).norm() / strand.length_m;
  }

 private:
  void FindAt(Index triangle, Index first_vertex, const Atlas& atlas, const MembraneMesh& mesh,
              const SheetPlaces& places);

  SceneView scene_;
  std::vector<float> thickness_;
  std::vector<Strand> strands_;
};

}  // namespace fulcrum::render
