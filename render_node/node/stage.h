// What is drawn and where: all of the render node's start that takes long, and nothing that needs the bus. A process
// that waits in reserve has it ready (services/nodes/app/spare.h).
#pragma once

#include <memory>

#include "render_node/scene_graph/display.h"
#include "render_node/scene_graph/laparoscope_view.h"

namespace fulcrum::render {

struct Stage {
  /// Builds the graph, opens OpenGL and draws once. Throws InputError when a window is asked for and no display can be
  /// opened, std::runtime_error when OpenGL is missing. The arrays of `scene` must outlive it.
  Stage(const SceneView& scene, bool window);

  LaparoscopeView view;
  std::unique_ptr<Display> display;
};

}  // namespace fulcrum::render
