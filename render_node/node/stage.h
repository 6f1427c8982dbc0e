// Scene graph and display: the slow part of the render node's start, independent of the bus. A spare process prepares
// it in advance (services/nodes/app/spare.h).
#pragma once

#include <memory>

#include "render_node/scene_graph/display.h"
#include "render_node/scene_graph/laparoscope_view.h"

namespace fulcrum::render {

struct Stage {
  /// Builds the graph, opens OpenGL and draws once. Throws InputError if a window is requested and no display can be
  /// opened, std::runtime_error if OpenGL is missing. The arrays of `scene` must outlive it.
  Stage(const SceneView& scene, bool window, const Look& look = {});

  LaparoscopeView view;
  std::unique_ptr<Display> display;
};

/// Makes a stage; throws as its constructor. @param spare true in a spare process: the stage is made on a thread of
/// lower priority, which the threads of the rasteriser inherit. Otherwise the session waits for it and it is made at
/// full priority on the calling thread.
[[nodiscard]] std::unique_ptr<Stage> MakeStage(const SceneView& scene, bool window, bool spare);

}  // namespace fulcrum::render
