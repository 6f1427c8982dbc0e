// Which vessels of a sheet clips have cut off from their supply. A clip closes every vessel within kClosed_m of the
// triangle of its anchors, in the sheet's own coordinates (s, t), if all three are nodes of sheets. A place is cut off
// if blood from a clip's far side alone could reach it: the living tissue of vessels that is joined to it ends at clips
// before it leaves the circle of kSupply_m around it or the sheet. Vessels may join, so one that has a way around the
// clips is not cut off. A piece within kPiece_m that cuts have separated from a vessel with a clip is cut off as well.
// Assumed: any vessel that goes on for kSupply_m is supplied there, and one that only ends is not what the clips cut
// off (without a clip every vessel bleeds). Pure.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

class VesselSupply {
 public:
  static constexpr float kClosed_m = 0.001f;
  static constexpr float kSupply_m = 0.025f;
  /// A living piece that ends within this distance may be what cuts have separated [m]: clips to cut between are some
  /// 10 mm apart. That of scene `clips` is 3.3 to 4.0 mm long in lock step.
  static constexpr float kPiece_m = 0.006f;
  /// Density of the pattern from which on blood flows there: all but the thinnest branches, which end soon.
  static constexpr float kVessel = 0.75f;

  /// @param vessels square pattern of four bytes per texel; alpha is the density of vessels. @param per_m repetitions
  /// of the pattern per metre of (s, t). Keeps references to the pattern and the arrays of `scene`.
  VesselSupply(const SceneView& scene, std::span<const std::uint8_t> vessels, int texels, float per_m)
      : scene_(scene), vessels_(vessels), texels_(texels), per_m_(per_m) {}

  /// Density of vessels at (s, t) [m], 0 … 1.
  [[nodiscard]] float VesselAt(const Vec2f& material) const;

  /// Replaces the clips. @pre anchors are vertices of the scene.
  void SetClips(std::span<const Clip> clips);
  /// A clip closes a part of a sheet: otherwise nothing is cut off.
  [[nodiscard]] bool has_clips() const { return !closed_.empty(); }

  /// Whether a vessel at (s, t) [m] is cut off. Visits the texels of vessels within kSupply_m at most; without clips
  /// none.
  [[nodiscard]] bool CutOff(const Vec2f& material, const Atlas& atlas);

  /// visit(material) for the texels [m] of the vessels beside clips that are cut off. Visits each such vessel within
  /// kSupply_m of a clip.
  void ForEachCutOff(const Atlas& atlas, const std::function<void(const Vec2f& material)>& visit);

 private:
  enum class Tissue { kLiving, kLivingOrLost };
  struct Ends {
    bool supplied = false, at_clip = false;
    float farthest_m = 0;  ///< From where it began.
  };
  /// Follows a vessel; its texels remain in filled_ and seen_ until Forget().
  [[nodiscard]] Ends Flood(const Vec2f& material, const Atlas& atlas, Tissue tissue);
  void Forget();
  [[nodiscard]] bool Carries(int x, int y, const Atlas& atlas, Tissue tissue) const;
  [[nodiscard]] bool Closed(const Vec2f& material) const;

  SceneView scene_;
  std::span<const std::uint8_t> vessels_;
  int texels_;
  float per_m_;
  std::vector<std::array<Vec2f, 3>> closed_;  // Triangles of clips, (s, t) [m].
  std::vector<std::uint8_t> seen_;            // Per texel of the atlas; scratch, all 0 between calls.
  std::vector<std::array<int, 2>> filled_;    // Scratch.
  int width_ = 0;                             // Of seen_.
};

}  // namespace fulcrum::render
