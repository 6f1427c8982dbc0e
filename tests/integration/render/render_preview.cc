// Draws a picture for a developer without the cart:
//
//   render_preview built-in|small|FILE.scene TIME_s OUT.png [TIP_x TIP_y TIP_z TARGET_x TARGET_y TARGET_z [BLEEDS_s]]
//   render_preview built-in clipped OUT.png [FIELD_deg]      (two clips on a vessel, synthetic_clips.h)
//
// With BLEEDS_s the cut has been made without coagulation so long ago, and a tube whose handle the script closes has
// aspirated for the last second.
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>

#include "render_node/offscreen/png_writer.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "tests/integration/render/synthetic_clips.h"

int main(int argc, char** argv) {
  using namespace fulcrum;
  if (argc < 4) {
    std::cerr << "usage: render_preview built-in|small|FILE.scene TIME_s OUT.png [scope tip and target, 6 numbers]\n";
    return 2;
  }
  try {
    const std::string name = argv[1];
    scene::SceneData data;
    std::unique_ptr<scene::SceneFile> file;
    SceneView view;
    if (name == "built-in" || name == "small") {
      data = scene::BuildProcedural(name == "small" ? scene::Small() : scene::BuiltIn());
      view = data.View();
    } else {
      file = std::make_unique<scene::SceneFile>(name);
      view = file->view();
    }
    if (argc >= 10) {
      for (int k = 0; k < 3; ++k) {
        view.render.scope_tip_W[k] = std::strtof(argv[4 + k], nullptr);
        view.render.scope_target_W[k] = std::strtof(argv[7 + k], nullptr);
      }
    }
    render::ClippedMoment clipped;
    if (std::string_view(argv[2]) == "clipped") {
      view.tools[render::kApplier] = scene::DefaultTool(ToolKind::kClipApplier, Vec3f(0.045f, -0.075f, 0.085f));
      clipped = render::MakeClippedMoment(view);
      view.render.scope_target_W = clipped.between_W - Vec3f(0, 0, 0.003f);
      view.render.fov_deg = argc == 5 ? std::strtof(argv[4], nullptr) : 15;
    } else {
      clipped.moment = render::MakeSyntheticMoment(view, std::strtod(argv[2], nullptr));
    }
    const render::SyntheticMoment& moment = clipped.moment;
    render::LaparoscopeView laparoscope(view);
    const auto display = render::MakeOffscreenDisplay(laparoscope, view.render);
    laparoscope.SetSmoothEdges(true);
    laparoscope.SetTissue(moment.tissue.xyz);
    laparoscope.SetTopology(moment.topology);
    laparoscope.SetClips(clipped.clips);
    const double bleeds_s = argc >= 11 ? std::strtod(argv[10], nullptr) : 0;
    for (TemperaturePatch patch : moment.patches) {
      for (std::size_t k = 0; bleeds_s > 0 && k < patch.texels.size(); k += 4) {
        patch.texels[k + 1] = patch.texels[k + 2] = 0;
      }
      laparoscope.ApplyPatch(patch);
    }
    for (int tool = 0; tool < kMaxTools; ++tool) {
      laparoscope.SetTool(tool, moment.tools.tools[static_cast<std::size_t>(tool)]);
      laparoscope.SetJaw(tool, moment.handles.handles[static_cast<std::size_t>(tool)].jaw_angle_rad);
    }
    if (!clipped.clips.empty()) (void)laparoscope.UpdateEffects(0);
    laparoscope.Update();
    for (const Vec2f& place : moment.cut_path) {
      if (bleeds_s > 0) laparoscope.OpenVessels(place, 0);
    }
    for (double time_s = 0.1; time_s < bleeds_s; time_s += 0.1) {
      for (int tool = 0; time_s > bleeds_s - 1 && tool < kMaxTools; ++tool) {
        const auto k = static_cast<std::size_t>(tool);
        if (view.tools[k].kind != ToolKind::kSuction) continue;
        TrumpetValve valve;
        (void)valve.Step(time_s, TrumpetValve::kLetGo_rad);
        laparoscope.SetFlow(tool, valve.Step(time_s, moment.handles.handles[k].jaw_angle_rad), time_s);
      }
      (void)laparoscope.UpdateEffects(time_s);
    }
    render::Bitmap picture;
    display->DrawAndRead(&picture);
    render::WritePng(picture, argv[3]);
    std::cerr << display->description() << '\n';
  } catch (const std::exception& error) {
    std::cerr << "render_preview: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
