#include "tests/support/working_scene.h"

#include <algorithm>
#include <sstream>

#include "tests/support/cart.h"

namespace fulcrum::testing {
namespace {

/// Places and times of the tools' work on a sheet [fractions of the sheet, mm, s].
struct Work {
  double grasp_s, pull_mm, depth_mm, cut_s, line_step, line_s;
};
constexpr Work kSmall{0.33, 9, -2.0, 0.55, 0.03, 10};
constexpr Work kBuiltIn{0.36, 10, -1.0, 0.52, 0.02, 20};
constexpr double kLineBegin = 0.3, kLineEnd = 0.7, kLastLine = 0.8;

}  // namespace

std::string WorkingScene(const std::string& base, double duration_s, const std::string& nodes) {
  const Work& work = base == "small" ? kSmall : kBuiltIn;
  std::string scene = ReadFile(FULCRUM_SOURCE_DIR "/deploy/scenes/" + base + ".yaml");
  scene.resize(scene.find("\nscript:"));
  std::ostringstream script;
  if (!nodes.empty()) script << "\nnodes: " << nodes << '\n';
  script << "\nscript:\n  duration_s: " << duration_s << "\n  tool0:\n";
  const auto grasper = [&](double time_s, double height_mm, double jaw_deg) {
    script << "    - {time_s: " << time_s << ", sheet: [" << work.grasp_s << ", 0.5], height_mm: " << height_mm
           << ", jaw_deg: " << jaw_deg << "}\n";
  };
  grasper(0.0, 10, 50);
  grasper(0.4, -2.5, 50);
  // Late enough that all nodes receive it on an overloaded machine: a node that misses the closing jaws has no grasp.
  grasper(1.2, -2.5, 50);
  grasper(1.6, -2.5, 0);
  double time_s = 2.2;
  for (int i = 0; time_s < duration_s; ++i, time_s += 0.5) grasper(time_s, work.pull_mm + (i % 2 == 0 ? 1 : -1), 0);
  script << "  tool1:\n";
  const auto hook = [&](double at_s, double s, double t, double height_mm, const char* pedal) {
    script << "    - {time_s: " << at_s << ", sheet: [" << s << ", " << t << "], height_mm: " << height_mm << pedal
           << "}\n";
  };
  constexpr const char* kCut = ", pedal: cut, power_W: 35";
  hook(0.0, work.cut_s, kLineBegin, 15, "");
  hook(0.9, work.cut_s, kLineBegin, work.depth_mm, "");
  double line = work.cut_s;
  time_s = 1.0;
  for (int i = 0; time_s < duration_s; ++i) {
    const bool back = i % 2 == 1;
    hook(time_s, line, back ? kLineEnd : kLineBegin, work.depth_mm, kCut);
    hook(std::min(time_s + work.line_s, duration_s), line, back ? kLineBegin : kLineEnd, work.depth_mm, kCut);
    line += line + work.line_step > kLastLine ? work.cut_s - line : work.line_step;
    time_s += work.line_s + 0.5;
  }
  return scene + script.str();
}

}  // namespace fulcrum::testing
