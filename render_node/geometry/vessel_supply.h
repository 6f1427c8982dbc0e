// Which vessels of a sheet clips have cut off from their supply. A clip closes every vessel within kClosed_m of the
// triangle of its anchors, in the sheet's own coordinates (s, t), if all three are nodes of sheets. A place is cut off
// if blood from a clip's far side alone could reach it: the living tissue of vessels that is joined to it ends at clips
// before it leaves the circle of kSupply_m around it or the sheet. Vessels may join, so one that has a way around the
// clips is not cut off. Assumed: any vessel that goes on for kSupply_m is supplied there, and one that only ends is not
// what the clips cut off (without a clip every vessel bleeds). Pure.
#pragma once

#include <array>
#include <cstdint>
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

 private:
  [[nodiscard]] bool Closed(const Vec2f& material) const;

  SceneView scene_;
  std::span<const std::uint8_t> vessels_;
  int texels_;
  float per_m_;
  std::vector<std::array<Vec2f, 3>> closed_;  // Triangles of clips, (s, t) [m].
  std::vector<std::uint8_t> seen_;            // Per texel of the atlas; scratch, all 0 between calls.
  std::vector<std::array<int, 2>> filled_;    // Scratch.
};

}  // namespace fulcrum::render
