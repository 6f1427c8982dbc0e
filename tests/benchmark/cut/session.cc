#include "tests/benchmark/cut/session.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/runtime/checkpoint.h"
#include "services/records/log_tools/cut_picture.h"
#include "services/records/log_tools/recording.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/format/scene_file.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum::benchmark {
namespace {

namespace fs = std::filesystem;

/// Offset of the trocar from the middle of the stroke where the foot points 70 and 45 degrees down into the sheet [m].
const Vec3d kTipFirst_m(94e-3, 0, 34e-3), kSlanted_m(71e-3, 0, 71e-3);
constexpr double kTouch_s = 1.0, kTouchBesideGrasper_s = 2.6, kTail_s = 0.4;
/// Time that a session takes beyond its script, to start, end and report [s].
constexpr double kPatience_s = 40;
/// Least fraction of the time with pressed pedal in which the generator must have been on.
constexpr double kLeastEnergised = 0.9;
constexpr int kTries = 3;

struct Place {
  double s, t;
};
Place MiddleOf(Held held) { return held == Held::kOrgan ? Place{0.5, 0.5} : Place{0.56, 0.5}; }

/// @param middle_W place of the sheet at rest around which the hook cuts [m].
Vec3d TrocarOf(Foot foot, const Vec3d& middle_W) {
  switch (foot) {
    case Foot::kUp:
      return {-85e-3, -45e-3, 115e-3};
    case Foot::kLevel:
      return {0, -120e-3, 110e-3};
    case Foot::kSlanted:
      return middle_W + kSlanted_m;
    case Foot::kDown:
      break;
  }
  return middle_W + kTipFirst_m;
}

/// Height of the heel above the sheet at rest [m].
double HeelHeightOf(Foot foot) {
  switch (foot) {
    case Foot::kUp:
      return 0.3e-3;
    case Foot::kLevel:
      return -1.0e-3;
    case Foot::kSlanted:
      return 1.8e-3;
    case Foot::kDown:
      break;
  }
  // The end of the foot is then 1.7 mm below the sheet, as with the slanted foot: it stands in the slit like a needle.
  return 3.0e-3;
}

bool UsesGrasper(Held held) { return held == Held::kTaut || held == Held::kTented; }

std::string GrasperKeys(Held held) {
  if (!UsesGrasper(held)) return "    - {time_s: 0, sheet: [0.36, 0.5], height_mm: 55, jaw_deg: 20}\n";
  std::ostringstream keys;
  const auto key = [&](double time_s, const char* rest) {
    keys << "    - {time_s: " << time_s << ", sheet: [0.36, 0.5], " << rest << "}\n";
  };
  key(0.0, "height_mm: 10, jaw_deg: 50");
  key(0.4, "height_mm: -2.5, jaw_deg: 50");
  key(0.6, "height_mm: -2.5, jaw_deg: 50");
  key(1.0, "height_mm: -2.5, jaw_deg: 0");
  key(2.4, held == Held::kTented ? "height_mm: 18, offset_mm: [-2, 0, 0], jaw_deg: 0"
                                 : "height_mm: 4, offset_mm: [-6, 0, 0], jaw_deg: 0");
  return keys.str();
}

std::string SceneYaml(const SessionPlan& plan, const StrokeTimes& times, const Vec3d& trocar_W) {
  const Place middle = MiddleOf(plan.held);
  std::ostringstream yaml;
  yaml << "name: " << plan.name << "\nbase: " << FULCRUM_SOURCE_DIR << "/deploy/scenes/built-in.yaml\n"
       << "nodes: [handle_bridge, haptics_node, physics_node, thermal_node]\n"
       << "tools:\n  tool0: {kind: grasper, trocar_mm: "
       << (plan.foot == Foot::kUp ? "[-85, 45, 115]" : "[-85, -45, 115]") << "}\n  tool1: {kind: hook, trocar_mm: ["
       << 1e3 * trocar_W.x() << ", " << 1e3 * trocar_W.y() << ", " << 1e3 * trocar_W.z() << "], tip_radius_mm: 0.5}\n"
       << "physics: {dt_ms: " << plan.dt_ms << ", preset: " << plan.preset
       << (plan.held == Held::kSlack ? ", membrane_prestrain: 0" : "") << "}\n"
       << "script:\n  duration_s: " << times.over_s + kTail_s << "\n  tool0:\n"
       << GrasperKeys(plan.held) << "  tool1:\n";
  // Positions come from the recorded motion; only pedal and power of the script are used. But the servo derives the
  // tool's roll from the first key: the foot turns to world y where the line from the trocar to that key is nearly
  // along x. The key therefore lies far aside, so that the foot turns to x in every posture.
  const auto key = [&](double time_s, const std::string& pedal) {
    yaml << "    - {time_s: " << time_s << ", sheet: [" << middle.s << ", " << middle.t << "], height_mm: 25" << pedal
         << "}\n";
  };
  std::ostringstream pressed;
  pressed << ", pedal: " << plan.pedal << ", power_W: " << plan.power_W;
  key(0, ", offset_mm: [0, 80, 0]");
  key(times.touch_s, pressed.str());
  key(times.end_s, "");
  return yaml.str();
}

std::string CartYaml(const SessionPlan& plan, const std::string& motion) {
  std::ostringstream yaml;
  yaml << "name: bench\nhandles:\n  tool0: {kind: simulated}\n  tool1: {kind: simulated, hand: right}\n"
       << "pedal: {kind: simulated}\ndevices:\n  tool0: {kind: simulated}\n  tool1:\n    kind: simulated\n"
       << "    motion: " << motion << "\n    workspace: {rotation_deg: [0, 0, 0], trocar_mm: [0, 0, 0], scale: 1}\n"
       << "nodes:\n  physics_node: {rate_Hz: " << 1000 / plan.dt_ms << "}\n";
  return yaml.str();
}

void Write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

/// Two programs that only use processor time. They run in sessions of their own, as programs of other users do. In the
/// cart's own session, whose processes share one part of the machine, the kernel thread that moves the bytes of a
/// pseudo-terminal does not run for seconds, and the pedal counts as up.
class Load {
 public:
  explicit Load(bool on) {
    for (int i = 0; on && i < 2; ++i) {
      const pid_t child = ::fork();
      if (child != 0) {
        children_.push_back(child);
        continue;
      }
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::setsid();
      volatile std::uint64_t busy = 0;
      while (true) {
        busy = busy + 1;
      }
    }
  }
  ~Load() {
    for (const pid_t child : children_) {
      if (child > 0) ::kill(child, SIGKILL);
      if (child > 0) ::waitpid(child, nullptr, 0);
    }
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  std::vector<pid_t> children_;
};

/// Kills thermal_node and physics_node in turn, `kills` times in all; returns how many were started again.
int KillNodes(const testing::Program& up, const fs::path& session, double limit_s, int kills) {
  // Checkpoints exist once tissue is warm.
  if (!testing::WaitFor(limit_s, [&] { return runtime::NewestSequence(session / "thermal_node.checkpoint") > 0; })) {
    return 0;
  }
  int back = 0;
  for (int i = 0; i < kills; ++i) {
    const auto next = std::chrono::steady_clock::now() + std::chrono::duration<double>(kKillPeriod_s);
    std::this_thread::sleep_for(next - std::chrono::steady_clock::now());
    const std::string node = i % 2 == 0 ? "thermal_node" : "physics_node";
    const auto before = testing::ChildrenOf(up.pid());
    if (!before.contains(node) || ::kill(before.at(node), SIGKILL) != 0) continue;
    back += testing::WaitFor(kKillPeriod_s,
                             [&] {
                               const auto now = testing::ChildrenOf(up.pid());
                               return now.contains(node) && now.at(node) != before.at(node);
                             })
                ? 1
                : 0;
  }
  return back;
}

/// Positions of the last TissueFrame before the hook touches.
std::vector<Vec3f> LastNodes(const fs::path& recording, const SceneView& scene) {
  std::vector<Vec3f> nodes;
  log_tools::Recording file(recording, {.topics = {"TissueFrame"}});
  log_tools::Entry entry;
  while (file.Next(&entry)) {
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (std::is_same_v<T, TissueFrame>) {
        const std::size_t first = scene.membrane.first, count = scene.membrane.node_count();
        if (message.xyz.size() < 3 * (first + count)) return;
        nodes.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
          nodes[i] = Eigen::Map<const Vec3f>(&message.xyz[3 * (first + i)]);
        }
      }
    });
  }
  return nodes;
}

}  // namespace

namespace {

/// Share of [from, to) in which the generator was on.
double EnergisedShare(const log_tools::CutMap& map, const StrokeTimes& times) {
  int all = 0, on = 0;
  for (const log_tools::CurrentSample& sample : map.recorded.current) {
    if (sample.time_s < times.touch_s || sample.time_s >= times.end_s) continue;
    ++all;
    on += sample.energised() ? 1 : 0;
  }
  return all > 0 ? static_cast<double>(on) / all : 0;
}

}  // namespace

std::string Describe(const SessionPlan& plan) {
  constexpr const char* kHeld[] = {"free", "slack", "organ", "taut", "tented"};
  constexpr const char* kFoot[] = {"down", "slanted", "up", "level"};
  std::ostringstream text;
  text << plan.name << ": " << NameOf(plan.shape) << ", " << plan.speed_mm_s << " mm/s, " << plan.power_W << " W "
       << plan.pedal << ", " << kHeld[static_cast<int>(plan.held)] << ", foot " << kFoot[static_cast<int>(plan.foot)]
       << (plan.loaded ? ", loaded" : "") << (plan.kills > 0 ? ", nodes killed" : "") << ", " << plan.dt_ms << " ms, "
       << plan.preset;
  return text.str();
}

SessionRunner::SessionRunner(fs::path keep)
    : folder_(fs::temp_directory_path() / ("bench_cut." + std::to_string(::getpid()))),
      keep_(std::move(keep)),
      // A domain that no other cart on this machine uses.
      domain_(20 + static_cast<int>(::getpid() % 75)) {
  fs::create_directories(folder_);
  if (!keep_.empty()) fs::create_directories(keep_);
}

SessionRunner::~SessionRunner() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::optional<log_tools::CutMap> SessionRunner::Run(const SessionPlan& plan) {
  std::fprintf(stderr, "%s\n", Describe(plan).c_str());
  const fs::path yaml = folder_ / (plan.name + ".yaml"), cart = folder_ / (plan.name + "-cart.yaml"),
                 motion = folder_ / (plan.name + ".csv");
  // The sheet does not depend on the times.
  Write(yaml, SceneYaml(plan, {1, 1.1, 2, 3}, TrocarOf(plan.foot, Vec3d::Zero())));
  const scene::CompiledScene compiled = scene::CompileScene(yaml, {}, {});
  const SceneView view = compiled.data.View();
  std::vector<Vec3f> nodes(view.rest_position.begin() + view.membrane.first,
                           view.rest_position.begin() + view.membrane.first + view.membrane.node_count());
  const Sheet sheet{view, nodes};
  const Place middle = MiddleOf(plan.held);
  const Vec3d trocar_W = TrocarOf(plan.foot, sheet.Above(sheet.MaterialAt(middle.s, middle.t), 0));
  if (UsesGrasper(plan.held)) nodes = PulledNodes(plan, trocar_W);
  if (nodes.empty()) return std::nullopt;
  const Sheet held{view, nodes};
  std::vector<Vec2d> course = CourseOf(plan.shape, 1e-3 * plan.longest_mm);
  for (Vec2d& place : course) place += sheet.MaterialAt(middle.s, middle.t);
  Stroke stroke = MakeStroke(held, course, trocar_W, 1e-3 * plan.speed_mm_s, HeelHeightOf(plan.foot),
                             UsesGrasper(plan.held) ? kTouchBesideGrasper_s : kTouch_s, plan.stay_s);
  Write(motion, haptics::ToText(stroke.motion));
  Write(yaml, SceneYaml(plan, stroke.times, trocar_W));
  Write(cart, CartYaml(plan, motion));
  std::optional<log_tools::CutMap> map;
  for (int i = 0; i < kTries; ++i) {
    map = RunFiles(plan.name, yaml, cart, stroke.times.over_s + kTail_s, plan.loaded, plan.kills);
    if (!map) break;
    const double share = EnergisedShare(*map, stroke.times);
    if (share >= kLeastEnergised) break;
    std::fprintf(stderr, "%s: the pedal was heard for %.0f %% of the stroke only: no measure of the cut\n",
                 plan.name.c_str(), 100 * share);
    map.reset();
    ++repeated_;
  }
  return map;
}

std::optional<log_tools::CutMap> SessionRunner::RunScene(const std::string& name, const std::string& base) {
  const fs::path yaml = folder_ / (name + ".yaml");
  Write(yaml, "name: " + name + "\nbase: " + FULCRUM_SOURCE_DIR + "/deploy/scenes/" + base +
                  ".yaml\nnodes: [handle_bridge, haptics_node, physics_node, thermal_node]\n");
  const double seconds = static_cast<double>(scene::CompileScene(yaml, {}, {}).data.fixed.script_duration_s);
  std::fprintf(stderr, "%s: script of %s\n", name.c_str(), base.c_str());
  return RunFiles(name, yaml, {}, seconds, false);
}

std::optional<log_tools::CutMap> SessionRunner::RunFiles(const std::string& name, const fs::path& scene,
                                                         const fs::path& cart, double seconds, bool loaded, int kills) {
  const fs::path out = folder_ / name;
  std::vector<std::string> arguments{"up",    scene, "--record", "--no-video", "--domain", std::to_string(domain_),
                                     "--out", out};
  if (!cart.empty()) arguments.insert(arguments.end(), {"--cart", cart});
  std::optional<int> code;
  std::string said;
  {
    const Load load(loaded);
    testing::Program up("fulcrum", arguments);
    if (kills > 0) killed_ += KillNodes(up, out / "latest", seconds + kPatience_s, kills);
    (void)testing::WaitFor(seconds + kPatience_s, [&] { return (code = up.Poll()).has_value(); });
    said = up.Said();
  }
  const fs::path session = out / "latest";
  std::optional<log_tools::CutMap> map;
  if (fs::exists(session / "recording.mcap")) {
    const scene::SceneFile file(session / "scene.fulcrum");
    map = log_tools::ReadCutMap(session / "recording.mcap", file.view());
    if (!keep_.empty()) {
      Write(keep_ / (name + ".png"), log_tools::DrawCutMap(*map, name));
      Write(keep_ / (name + ".json"), log_tools::FiguresJson(*map));
      std::error_code ignored;
      fs::remove_all(keep_ / name, ignored);
      fs::create_directories(keep_ / name);
      for (const char* part : {"recording.mcap", "scene.fulcrum", "configuration.yaml", "cart.yaml"}) {
        fs::copy_file(session / part, keep_ / name / part, ignored);
      }
    }
  }
  // A node that ran late makes `fulcrum up` fail, but the recording stays usable.
  if (code != 0) std::fprintf(stderr, "%s: fulcrum up: %s\n", name.c_str(), said.c_str());
  if (name.ends_with("-probe")) return map;
  fs::remove_all(out);
  return map;
}

std::vector<Vec3f> SessionRunner::PulledNodes(const SessionPlan& plan, const Vec3d& trocar_W) {
  // The hook stays off the sheet.
  SessionPlan probe = plan;
  probe.name = plan.name + "-probe";
  const fs::path yaml = folder_ / (probe.name + ".yaml");
  Write(yaml, SceneYaml(probe, {1, 1.1, 2, kTouchBesideGrasper_s}, trocar_W));
  if (!RunFiles(probe.name, yaml, {}, kTouchBesideGrasper_s + kTail_s, false)) return {};
  const fs::path session = folder_ / probe.name / "latest";
  const scene::SceneFile file(session / "scene.fulcrum");
  std::vector<Vec3f> nodes = LastNodes(session / "recording.mcap", file.view());
  fs::remove_all(folder_ / probe.name);
  return nodes;
}

}  // namespace fulcrum::benchmark
