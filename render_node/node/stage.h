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

/// Makes a stage; throws as its constructor. @param spare of a process that waits in reserve: it is made on a thread of
/// lower priority, and so are the rasteriser's threads, which that one starts. A node that the session waits for makes
/// it at full priority on the calling thread.
[[nodiscard]] std::unique_ptr<Stage> MakeStage(const SceneView& scene, bool window, bool spare);

}  // namespace fulcrum::render
