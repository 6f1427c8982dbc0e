// Draws a picture for a developer without the cart:
//
//   render_preview built-in|small|FILE.scene TIME_s OUT.png [TIP_x TIP_y TIP_z TARGET_x TARGET_y TARGET_z]
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include "render_node/offscreen/png_writer.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "tests/integration/render/synthetic_scene.h"

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
    const render::SyntheticMoment moment = render::MakeSyntheticMoment(view, std::strtod(argv[2], nullptr));
    render::LaparoscopeView laparoscope(view);
    const auto display = render::MakeOffscreenDisplay(laparoscope, view.render);
    laparoscope.SetTissue(moment.tissue.xyz);
    laparoscope.SetTopology(moment.topology);
    for (const TemperaturePatch& patch : moment.patches) {
      laparoscope.ApplyPatch(patch);
    }
    for (int tool = 0; tool < kMaxTools; ++tool) {
      laparoscope.SetTool(tool, moment.tools.tools[static_cast<std::size_t>(tool)]);
      laparoscope.SetJaw(tool, moment.handles.handles[static_cast<std::size_t>(tool)].jaw_angle_rad);
    }
    laparoscope.Update();
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
