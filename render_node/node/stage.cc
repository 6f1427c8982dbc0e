#include "render_node/node/stage.h"

#include <unistd.h>

#include <array>
#include <future>

#include "render_node/node/drawing_threads.h"
#include "render_node/node/hud.h"

namespace fulcrum::render {
namespace {

std::unique_ptr<Display> OpenDisplay(const LaparoscopeView& view, const RenderParams& params, bool window) {
  return window ? MakeWindowDisplay(view, params) : MakeOffscreenDisplay(view, params);
}

/// Draws a first picture. It takes seconds on a loaded machine, because the rasteriser compiles each shader at its
/// first use; this must not happen during the session.
void WarmUp(const SceneView& scene, Stage* stage) {
  LaparoscopeView& view = stage->view;
  for (int k = 0; k < kMaxTools; ++k) {
    ToolSample shown;
    shown.kind = scene.tools[static_cast<std::size_t>(k)].kind;
    view.SetTool(k, shown);
  }
  HudState hud;
  hud.force_limit_N = ForceLimit(scene);
  view.SetTexts(HudTexts(hud, scene.render.hud != 0));
  view.AddSmoke(Vec2f::Zero(), -10);
  static_cast<void>(view.UpdateEffects(-9.9));
  view.SetSmoothEdges(true);
  // Few pixels are enough to compile the shaders, and a session waits for a restarted node.
  constexpr float kFewPixels = 0.25f;
  view.SetScale(kFewPixels);
  view.Update();
  Bitmap picture;
  view.RehearseBurn(true);
  stage->display->DrawAndRead(&picture);
  view.RehearseBurn(false);
  if (FindTool(scene.tools, ToolKind::kScope)) {
    view.SetSoil(1);
    stage->display->DrawAndRead(&picture);
    view.SetSoil(0);
  }
  for (int k = 0; k < kMaxTools; ++k) {
    view.SetTool(k, ToolSample());
  }
}

}  // namespace

Stage::Stage(const SceneView& scene, bool window, const Look& look)
    : view(scene, look), display(OpenDisplay(view, scene.render, window)) {
  WarmUp(scene, this);
}

std::unique_ptr<Stage> MakeStage(const SceneView& scene, bool window, bool spare) {
  const auto make = [&] {
    if (spare) LowerPriority(std::array{gettid()});
    return std::make_unique<Stage>(scene, window);
  };
  return std::async(spare ? std::launch::async : std::launch::deferred, make).get();
}

}  // namespace fulcrum::render
