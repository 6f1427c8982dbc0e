// Solids of instruments whose meshes the scene contains. Pure.
#pragma once

#include "render_node/geometry/solid.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// A part of `scene`'s tool meshes in frame T: smooth where faces meet at less than 40 degrees, with an edge where they
/// meet more sharply; insulated along the shaft and bare steel from the hinge or the electrode's neck on.
[[nodiscard]] Solid InstrumentSolid(const SceneView& scene, const ToolMesh& mesh);

}  // namespace fulcrum::render
