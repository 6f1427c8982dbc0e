// Ground truth of a picture: for each pixel what it shows, how far away it is, where it moves, and its state of heat.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render_node/geometry/rasteriser.h"
#include "render_node/geometry/solid_burn.h"
#include "render_node/scene_graph/drawn_surfaces.h"
#include "render_node/scene_graph/laparoscope_view.h"
#include "services/apps/replayer/channels.h"

namespace fulcrum::replay {

/// What a pixel can show; the numbers are those of the class images.
enum class TruthClass : std::uint8_t {
  kNone,  ///< Beside the round field.
  kSurroundings,
  kRectum,
  kFat,
  kMembrane,
  kGrasper,
  kHook,
  kScissors,
  kOrgan,    ///< A solid that is no bowel.
  kSuction,  ///< A suction and irrigation tube.
  kClipApplier,
  kClip  ///< A clip on the tissue.
};
inline constexpr int kTruthClasses = 12;
[[nodiscard]] const char* NameOf(TruthClass what);
[[nodiscard]] bool IsTool(TruthClass what);

/// Instances: a tissue's is its class, tool k's is kFirstToolInstance + k, the k-th organ's kFirstOrganInstance + k,
/// the k-th clip's of ClipState kFirstClipInstance + k.
inline constexpr int kFirstToolInstance = 16, kFirstOrganInstance = 32, kFirstClipInstance = 64;

inline constexpr double kDepthUnit_m = 2e-5;        ///< Of a depth image; 0: nothing.
inline constexpr double kFlowUnit_px = 1.0 / 64;    ///< Of a flow image, whose zero is 32768.
inline constexpr double kTemperatureUnit_C = 0.01;  ///< Of a temperature image; 0: unknown.
enum class FlowState : std::uint16_t {
  kNone,
  kVisible,
  kHidden,  ///< Or outside the field.
  kFar      ///< Visible, but farther away than a flow image can tell.
};

/// For LaparoscopeView::SetDetail(): tissue is drawn alike in all pictures, within a sixteenth of half a pixel.
inline constexpr float kTruthDetail = 16;

/// What a camera sees at one moment.
struct Moment {
  /// Takes the surfaces as of the view's last Update().
  Moment(render::LaparoscopeView* view, const render::Laparoscope& from, const SceneView& scene, int columns, int rows);

  render::Laparoscope scope;
  std::array<ToolKind, kMaxTools> kinds{};
  int width, height;
  std::vector<render::DrawnSurface> surfaces;
  render::Atlas atlas;
  bool draws_cuts = true;                    ///< render::DrawsCuts.
  std::optional<render::DrawnSurface> burn;  ///< Over the solids; none: no burnt chart of them is in the field.
  render::BurnCharts burnt;                  ///< Texels of the charts of `burn`.
};

/// The ground truth of a moment.
class Truth {
 public:
  /// The membrane counts where its upper layer is intact, however translucent; the fat where it is bared or the
  /// membrane above is removed; smoke, blood and shadows are not seen.
  explicit Truth(Moment moment);

  [[nodiscard]] const render::Pinhole& camera() const { return raster_.camera(); }
  [[nodiscard]] const render::Rasteriser& raster() const { return raster_; }
  /// Place in the picture [pixels, from the lower left], and depth [m].
  [[nodiscard]] std::pair<Vec2d, double> PlaceOf(const Vec3d& p_W) const;
  /// Whether nothing stands before a point, with a tolerance [m].
  [[nodiscard]] bool Sees(const Vec3d& p_W, double tolerance_m) const;
  /// Frame W to a camera frame with x to the right, y down and z ahead.
  [[nodiscard]] Eigen::Matrix4d world_to_camera() const;

  [[nodiscard]] TruthClass ClassOf(const render::Hit& hit) const;
  [[nodiscard]] int InstanceOf(const render::Hit& hit) const;
  /// Class of an instance that a pixel can show.
  [[nodiscard]] TruthClass ClassOf(int instance) const;
  /// Where the point of a pixel is, frame W.
  [[nodiscard]] Vec3d PointOf(const render::Hit& hit) const;
  /// Material coordinates of a pixel of membrane or fat [m].
  [[nodiscard]] std::optional<Vec2d> MaterialOf(const render::Hit& hit) const;

  [[nodiscard]] Channel Classes() const;
  [[nodiscard]] Channel Instances() const;
  [[nodiscard]] Channel Depth() const;
  /// Unit normals of the triangles, facing the camera, in the frame of world_to_camera(); 127.5 (n + 1).
  [[nodiscard]] Channel Normals() const;
  /// Displacement to the picture `next`, right and down [kFlowUnit_px], and a FlowState. Both displacements are 0,
  /// which is none, in the states kNone and kFar, and of what lies behind the camera or farther away than can be told.
  [[nodiscard]] Channel FlowTo(const Truth& next) const;
  /// Of membrane, fat, and the charts of solids that have a burn; 0 elsewhere. Taken when the object is made.
  [[nodiscard]] const Channel& temperature() const { return temperature_; }
  [[nodiscard]] const Channel& damage() const { return damage_; }  ///< Share of denatured collagen, 255: all.
  [[nodiscard]] const Channel& water() const { return water_; }    ///< Share left, 255: all.

 private:
  using Corner = std::array<float, 4>;
  void Draw(const render::Atlas& atlas, bool draws_cuts);
  void TakeHeat(const render::Atlas& atlas);
  void TakeHeatOfSolids(const render::DrawnSurface& burn, const render::BurnCharts& charts);
  void SetHeat(int x, int y, const std::array<std::uint8_t, 4>& texel);
  /// Corners in the camera frame.
  [[nodiscard]] std::vector<Vec3d> InCamera(const render::DrawnSurface& surface) const;
  [[nodiscard]] std::optional<Corner> CoordinateOf(const render::Hit& hit) const;
  /// Unit normal of the triangle, frame W, on either side.
  [[nodiscard]] Vec3d NormalOf(const render::Hit& hit) const;
  /// Longest extent of the pixel on its surface, at most ten times that on a surface that faces the camera [m].
  [[nodiscard]] double Footprint(const render::Hit& hit) const;
  /// Whether a point that comes to this place and depth is visible here. @param material of a sheet. @param is_same
  /// whether places of a sheet that are so far apart [m] are one.
  template <class SamePlace>
  [[nodiscard]] FlowState StateOf(const Vec2d& place, double depth_m, const render::DrawnSurface* surface,
                                  const std::optional<Vec2d>& material, const SamePlace& is_same) const;
  /// The surfaces in another moment; null: it is gone.
  [[nodiscard]] std::vector<const render::DrawnSurface*> SurfacesIn(const Truth& other) const;
  /// Whether the triangle is the same tissue in that moment.
  [[nodiscard]] bool IsSame(const render::Hit& hit, const render::DrawnSurface* then) const;
  template <class Value>
  [[nodiscard]] Channel Make(int bits, int samples, const Value& value) const;

  Eigen::Matrix4d view_;
  std::array<ToolKind, kMaxTools> kinds_;
  std::vector<render::DrawnSurface> surfaces_;
  std::vector<TruthClass> classes_;  // Of each surface.
  std::map<std::string, std::size_t> index_;
  render::Rasteriser raster_;
  Channel temperature_, damage_, water_;
};

}  // namespace fulcrum::replay
