// A synthetic state with clips: the built-in scene's sheet is held up in a fold along a vessel, two clips close the
// vessel across the fold, and the clip applier has just let go of the second one.
#pragma once

#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {

struct ClippedMoment {
  SyntheticMoment moment;
  std::vector<Clip> clips;
  Vec2f between = Vec2f::Zero();    ///< Material place on the vessel in the middle between the clips [m].
  Vec3f between_W = Vec3f::Zero();  ///< The same, on the crest of the fold [m].
};

inline constexpr int kApplier = 2;  ///< Tool that MakeClippedMoment poses.

/// @pre `scene` is the built-in one with a clip applier as tool kApplier.
[[nodiscard]] ClippedMoment MakeClippedMoment(const SceneView& scene);

}  // namespace fulcrum::render
