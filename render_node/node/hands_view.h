// What a hand at the window must know of the picture: where a pixel lies, and where the tools are.
#pragma once

#include "services/base/core/mouse_hands.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// @param height of the picture [pixels].
[[nodiscard]] HandsView MakeHandsView(const SceneView& scene, const RenderParams& camera, int height,
                                      const ToolState& tools);

}  // namespace fulcrum::render
