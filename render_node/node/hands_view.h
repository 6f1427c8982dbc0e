// What a hand at the window must know of the picture, and a reader of live pictures: where a pixel lies, and where the
// tools are.
#pragma once

#include <array>

#include "services/base/core/mouse_hands.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// With stereo the eye is the one in the middle, and a pixel is one of an eye's part stretched to the whole picture, as
/// a 3-D display shows it: a motion of the pointer means the same in either part.
/// @param height of the picture [pixels]. @param roll_references of the scene's tools (below).
[[nodiscard]] HandsView MakeHandsView(const SceneView& scene, const RenderParams& camera, int height,
                                      const ToolState& tools, const HandleState& handles,
                                      const std::array<Vec3d, kMaxTools>& roll_references);

/// RollReference of each tool of a scene.
[[nodiscard]] std::array<Vec3d, kMaxTools> RollReferences(const SceneView& scene);

/// The same for the header of a picture. Stamp, times and sequences remain to be set.
[[nodiscard]] PictureHeader MakePictureHeader(const HandsView& view);

}  // namespace fulcrum::render
