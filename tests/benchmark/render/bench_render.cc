// What a picture costs: the built-in scene in the middle of its cut, off screen.
#include <cstdio>
#include <osg/GraphicsContext>
#include <osg/State>

#include "render_node/geometry/atlas.h"
#include "render_node/offscreen/egl_context.h"
#include "render_node/scene_graph/atlas_texture.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/build.h"
#include "tests/benchmark/report.h"
#include "tests/integration/render/synthetic_scene.h"

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  if (!report.Wants("render.")) {
    return 0;
  }
  try {
    const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
    const SceneView view = data.View();
    render::LaparoscopeView laparoscope(view);
    const auto display = render::MakeOffscreenDisplay(laparoscope, view.render);
    const render::SyntheticMoment moment = render::MakeSyntheticMoment(view, 12.0);
    laparoscope.SetTissue(moment.tissue.xyz);
    laparoscope.SetTopology(moment.topology);
    for (const TemperaturePatch& patch : moment.patches) {
      laparoscope.ApplyPatch(patch);
    }
    for (int tool = 0; tool < kMaxTools; ++tool) {
      laparoscope.SetTool(tool, moment.tools.tools[static_cast<std::size_t>(tool)]);
    }
    const int repeats = report.quick() ? 15 : 60;
    const auto cpu_side = benchmark::TimeMs(3, repeats, [&] {
      laparoscope.SetTissue(moment.tissue.xyz);
      laparoscope.Update();
    });
    render::Picture picture;
    const auto frame = benchmark::TimeMs(3, repeats, [&] {
      laparoscope.SetTissue(moment.tissue.xyz);
      laparoscope.Update();
      display->DrawAndRead(&picture);
    });
    // One patch into the atlas' texture, on a context of its own.
    render::EglContext context;
    context.MakeCurrent();
    render::Atlas atlas(view);
    render::AtlasTexture texture(atlas);
    osg::ref_ptr<osg::State> state = new osg::State;
    state->setContextID(osg::GraphicsContext::createNewContextID());
    state->initializeExtensionProcs();
    texture.texture()->apply(*state);
    glFinish();
    const auto upload = benchmark::TimeMs(3, repeats, [&] {
      texture.Update(atlas.Apply(moment.patches.front()));
      texture.texture()->apply(*state);
      glFinish();
    });
    report.Add("render.width", view.render.width, "pixels");
    report.Add("render.height", view.render.height, "pixels");
    report.Add("render.frame_ms_p50", benchmark::Quantile(frame, 0.5), "ms");
    report.Add("render.cpu_side_ms_p50", benchmark::Quantile(cpu_side, 0.5), "ms");
    report.Add("render.subtexture_update_ms_p50", benchmark::Quantile(upload, 0.5), "ms");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_render: %s\n", error.what());
    return 1;
  }
  return 0;
}
