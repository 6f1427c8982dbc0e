#include "render_node/offscreen/graphics_report.h"

#include <cstdio>
#include <exception>
#include <string_view>

#include "render_node/offscreen/egl_context.h"

namespace fulcrum::render {

bool AsksForGraphics(int argc, char** argv) { return argc == 2 && std::string_view(argv[1]) == "--graphics"; }

ExitCode PrintGraphics(const std::function<void()>& confine) {
  try {
    confine();
    std::puts(EglContext().description().c_str());
    return ExitCode::kDone;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return ExitCode::kFailure;
  }
}

}  // namespace fulcrum::render
