// Where clips hold a sheet, in its own coordinates: the picture draws the tissue around this line together. Pure.
#pragma once

#include <optional>
#include <span>

#include "services/base/core/clips.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// Middle line of the tissue between the legs of a clip: its ends, (s, t) [m]. On a fold that the clip crosses it runs
/// over the crest from one flank to the other.
struct ClipFootprint {
  Vec2f from = Vec2f::Zero(), to = Vec2f::Zero();
  bool operator==(const ClipFootprint& other) const { return from == other.from && to == other.to; }
};

/// The line along which the nodes of the sheets that lie between the legs are spread most. None where the clip holds
/// no sheet: fewer than two nodes lie there, and an anchor is of a solid.
/// @param pose of the clip [W]. @param xyz places of all vertices [m, W], three floats each.
/// @pre the clip's anchors are vertices of the scene.
[[nodiscard]] std::optional<ClipFootprint> FootprintOf(const Clip& clip, const ClipPose& pose, const SceneView& scene,
                                                       std::span<const float> xyz);

}  // namespace fulcrum::render
