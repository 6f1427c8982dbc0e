// Force at the hand with the real physics_node over DDS (haptics.live*), and with servo and physics in this process
// and simulated time, where no step runs late (haptics.in_time*) or each second one does, so that each third period is
// missed (haptics.late*); all against the same physics run at 1 kHz with the tool poses that the servo published.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "haptics_node/device/simulated_device.h"
#include "haptics_node/servo/servo.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/base/core/operator_script.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum {
namespace {

constexpr int kDomain = 96;
constexpr double kPatience_s = 20;

struct Part {
  const char* name;
  double from_s, to_s;
};
constexpr double kTap_s = 6.0, kAlong_s = 9.5, kAcross_s = 13.0, kGrasp_s = 18.0, kEnd_s = kGrasp_s + 6.0;
constexpr std::array kParts{Part{"press", 0.8, 2.2},
                            Part{"palpate", 2.2, 5.2},
                            Part{"tap", kTap_s, kAlong_s - 0.5},
                            Part{"slide_along", kAlong_s, kAcross_s - 0.5},
                            Part{"slide_across", kAcross_s, kAcross_s + 3.0},
                            Part{"grasp", kGrasp_s + 0.9, kEnd_s}};

/// Tool 0 on the built-in scene: presses 6 mm, palpates once a second, taps twice a second, slides by 4 mm to and fro
/// each second, 4 mm deep, grasps the membrane, and pulls it up and down.
scene::SceneSettings LiveScene() {
  scene::SceneSettings settings = scene::BuiltIn();
  constexpr double kOpen = 0.87, kNeither = 0.35;
  settings.script.clear();
  const auto key = [&](int tool, double time_s, const Vec2f& sheet, double height_m, double jaw_rad) {
    settings.script.push_back({.time_s = time_s,
                               .tool = tool,
                               .world_m = {},
                               .sheet = sheet,
                               .height_m = height_m,
                               .offset_m = Vec3f::Zero(),
                               .jaw_rad = jaw_rad,
                               .pedals = kPedalNone,
                               .power_W = 0});
  };
  const Vec2f place(0.40f, 0.5f);
  key(0, 0.0, place, 0.010, kNeither);
  key(0, 0.4, place, 0.004, kNeither);
  key(0, 1.2, place, -0.006, kNeither);
  for (int i = 0; i < 7; ++i) key(0, 2.2 + 0.5 * i, place, i % 2 == 0 ? -0.006 : -0.003, kNeither);
  for (int i = 0; i < 13; ++i) key(0, kTap_s + 0.25 * i, place, i % 2 == 0 ? 0.002 : -0.003, kNeither);
  const auto slide = [&](double from_s, const Vec2f& way) {
    for (int i = 0; i < 7; ++i) {
      const Vec2f at = place + (i % 2 == 0 ? -0.5f : 0.5f) * way;
      key(0, from_s + 0.5 * i, at, -0.004, kNeither);
    }
  };
  const scene::MembraneSettings& membrane = settings.membrane;
  // The sheet's first coordinate runs across the organ, the second along it.
  slide(kAlong_s, Vec2f(0.0f, 0.004f / static_cast<float>(settings.tube.length_m)));
  slide(kAcross_s, Vec2f(0.004f / static_cast<float>(membrane.width_m), 0.0f));
  key(0, kGrasp_s - 1.0, place, 0.010, kOpen);
  key(0, kGrasp_s, place, -0.001, kOpen);
  key(0, kGrasp_s + 0.3, place, -0.001, 0);
  for (int i = 0; i < 11; ++i) key(0, kGrasp_s + 0.9 + 0.5 * i, place, i % 2 == 0 ? 0.012 : 0.008, 0);
  key(1, 0.0, Vec2f(0.62f, 0.42f), 0.020, 0);
  settings.script_duration_s = kEnd_s;
  return settings;
}

struct Sample {
  double time_s;
  ToolSample tool;
  bool cheaper;            ///< Physics reports that it ran late and uses a cheaper preset.
  std::uint64_t overruns;  ///< Of physics since its start, as last reported: periods without a step.
};

/// Adds the ticks of the servo that it did not publish, because linear interpolation gives them.
std::vector<Sample> EachTick(const std::vector<Sample>& published) {
  std::vector<Sample> ticks;
  for (std::size_t i = 0; i < published.size(); ++i) {
    const Sample& a = published[i];
    ticks.push_back(a);
    if (i + 1 == published.size()) break;
    const Sample& b = published[i + 1];
    const auto count = static_cast<int>(std::lround(1e3 * (b.time_s - a.time_s)));
    for (int k = 1; k < count; ++k) {
      const float u = static_cast<float>(k) / static_cast<float>(count);
      Sample between = a;
      between.time_s += static_cast<double>(u) * (b.time_s - a.time_s);
      between.tool.p_WT += u * (b.tool.p_WT - a.tool.p_WT);
      between.tool.f_W += u * (b.tool.f_W - a.tool.f_W);
      between.tool.q_WT = a.tool.q_WT.normalized().slerp(u, b.tool.q_WT.normalized());
      ticks.push_back(between);
    }
  }
  return ticks;
}

/// Runs the session and returns what the servo did with tool 0, tick by tick.
/// @param step of physics_node, as last reported.
std::vector<Sample> Record(const SceneView& scene, const std::filesystem::path& folder, TimingSummary* step) {
  bus::DdsParticipant participant({.domain = kDomain, .node_name = "benchmark", .shared_memory = {}});
  const auto manifests = participant.MakeOutput<SceneManifest>();
  const auto handles = participant.MakeOutput<HandleState>();
  const auto tools = participant.MakeInput<ToolState>();
  const auto healths = participant.MakeInput<Health>();
  const std::vector<std::string> arguments{"--scene", folder / "scene", "--session",
                                           folder,    "--domain",       std::to_string(kDomain)};
  const testing::Program haptics("haptics_node", arguments), physics("physics_node", arguments);
  std::set<NodeId> waiting;
  Health health;
  const bool both_wait = testing::WaitFor(kPatience_s, [&] {
    while (healths->TakeNext(&health)) {
      if (health.state == HealthState::kWaiting) waiting.insert(health.node);
    }
    return waiting.size() == 2;
  });
  if (!both_wait) return {};
  SceneManifest manifest;
  manifest.scene_name = scene.name;
  manifest.session_id = "benchmark";
  manifest.scene_hash = scene.hash;
  const std::int64_t start = runtime::MonotonicNs();
  manifest.stamp = bus::Stamper(start).Next(start);
  manifest.session_start_ns = start;
  manifests->Write(manifest);
  bus::Stamper stamper(start);
  std::vector<Sample> samples;
  ToolState state;
  bool cheaper = false;
  std::uint64_t overruns = 0;
  for (double time_s = 0; time_s < scene.script_duration_s;) {
    const std::int64_t now = runtime::MonotonicNs();
    time_s = 1e-9 * static_cast<double>(now - start);
    HandleState handle;
    handle.stamp = stamper.Next(now);
    for (std::uint32_t i = 0; i < kMaxTools; ++i) {
      handle.handles[i] = {true, EvaluateScript(scene.script, i, time_s).jaw_rad, 0, 1, 0};
    }
    handles->Write(handle);
    while (healths->TakeNext(&health)) {
      if (health.node == NodeId::kPhysics) {
        overruns = health.overruns;
        *step = health.step;
        cheaper = std::any_of(health.metrics.begin(), health.metrics.end(),
                              [](const Metric& metric) { return metric.name == "cheaper_presets"; });
      }
    }
    while (tools->TakeNext(&state)) {
      samples.push_back({1e-9 * static_cast<double>(state.stamp.stamp_ns - start), state.tools[0], cheaper, overruns});
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return EachTick(samples);
}

/// Pose of tool 0 as physics takes it.
physics::ToolInput InputOf(const SceneView& scene, const Sample& sample, double time_s) {
  physics::ToolInput input;
  input.present = sample.tool.kind != ToolKind::kNone;
  input.pose.p_WT = sample.tool.p_WT;
  input.pose.q_WT = sample.tool.q_WT.normalized();
  input.pose.jaw_rad = EvaluateScript(scene.script, 0, time_s).jaw_rad;
  return input;
}

/// The same session without processes and clock: a step of physics begins kWake_ms after its session time, and its
/// contact model arrives kStep_ms later. Tool 0 alone.
/// @param late each second step takes kLateStep_ms; the next period is missed, as in physics_node with a cheaper
/// preset.
std::vector<Sample> Simulate(const SceneView& scene, bool late) {
  constexpr int kWake_ms = 1, kStep_ms = 6, kLateStep_ms = 13;
  constexpr std::int64_t kStart_ns = 1'000'000'000, kMs_ns = 1'000'000;
  const auto device = haptics::MakeScriptedDevice(scene, 0, haptics::HandModel(scene.haptics));
  haptics::Servo servo(haptics::ServoSettingsOf(scene), {device.get()});
  physics::TissueSimulation simulation(scene);
  const int period_ms = static_cast<int>(std::lround(1e3f * scene.physics.dt_s));
  std::vector<Sample> samples;
  simulation.SetCheaper(late ? 1 : 0);
  ContactModel model;
  int model_ms = 0;
  model.stamp.epoch = 1;
  model.physics_dt_s = scene.physics.dt_s;
  for (int ms = 0; ms < static_cast<int>(1e3 * scene.script_duration_s); ++ms) {
    Tick tick;
    tick.index = static_cast<std::uint64_t>(ms);
    tick.dt_s = 1e-3;
    tick.session_time_s = 1e-3 * ms;
    tick.stamp_ns = kStart_ns + ms * kMs_ns;
    if (ms == model_ms) servo.OfferModel(model, tick.stamp_ns);
    servo.Step(tick);
    samples.push_back({tick.session_time_s, servo.record().tool.tools[0], false, 0});
    const int turn = late ? ms / period_ms % 3 : 0;
    if (ms % period_ms == kWake_ms && turn != 2) {
      const int of_ms = ms - kWake_ms;
      const auto at = static_cast<std::size_t>(of_ms);
      (void)simulation.Step({InputOf(scene, samples[at], samples[at].time_s)}, late && turn == 0 ? 2 : 1);
      model_ms = ms + (turn == 1 ? kLateStep_ms : kStep_ms);
      model.devices[0] = simulation.Contacts(0);
      model.tool_sequence = ++model.stamp.sequence;
      model.stamp.stamp_ns = tick.stamp_ns;
      model.tool_stamp_ns = kStart_ns + of_ms * kMs_ns;
    }
  }
  return samples;
}

/// Force of the tissue on tool 0 at each millisecond, for the recorded tool poses.
std::vector<Vec3f> Truth(SceneView scene, const std::vector<Sample>& samples) {
  scene.physics.dt_s = 1e-3f;
  scene.physics.preset = PhysicsPreset::kFast;  // one substep a millisecond
  physics::TissueSimulation simulation(scene);
  std::vector<Vec3f> forces;
  std::size_t at = 0;
  for (int ms = 0; ms < static_cast<int>(1e3 * scene.script_duration_s); ++ms) {
    const double time_s = 1e-3 * ms;
    while (at + 1 < samples.size() && samples[at + 1].time_s <= time_s) ++at;
    (void)simulation.Step({InputOf(scene, samples[at], time_s)});
    const DeviceContacts contacts = simulation.Contacts(0);
    Vec3f force = Vec3f::Zero();
    for (std::uint32_t i = 0; i < contacts.count; ++i) force += contacts.contacts[i].f_ref;
    forces.push_back(force);
  }
  return forces;
}

/// @param name of the keys, after "haptics.".
void AddErrors(const SceneView& scene, const std::string& name, const std::vector<Sample>& samples,
               benchmark::Report* report) {
  const std::vector<Vec3f> truth = Truth(scene, samples);
  double all_error = 0, all_truth = 0;
  for (const Part& part : kParts) {
    double error = 0, size = 0, largest = 0;
    for (const Sample& sample : samples) {
      const int ms = static_cast<int>(std::lround(1e3 * sample.time_s));
      if (sample.time_s < part.from_s || sample.time_s >= part.to_s || ms >= static_cast<int>(truth.size())) continue;
      // The published force is scaled for the hand.
      const Vec3f felt = sample.tool.f_W / scene.haptics.force_scale;
      error += (felt - truth[ms]).squaredNorm();
      size += truth[ms].squaredNorm();
      largest = std::max<double>(largest, truth[ms].norm());
    }
    report->Add("haptics." + name + "_force_error_pct." + part.name, 100 * std::sqrt(error / size), "%");
    report->Add("haptics." + name + "." + part.name + ".largest_N", largest, "N");
    all_error += error;
    all_truth += size;
  }
  report->Add("haptics." + name + "_force_error_pct", 100 * std::sqrt(all_error / all_truth), "%");
}

/// What the machine did meanwhile.
void AddLateness(const std::vector<Sample>& samples, const TimingSummary& step, benchmark::Report* report) {
  for (const Part& part : kParts) {
    int unusual = 0, cheaper = 0;
    std::uint64_t first_overruns = ~std::uint64_t{0}, overruns = 0;
    for (const Sample& sample : samples) {
      if (sample.time_s < part.from_s || sample.time_s >= part.to_s) continue;
      unusual += sample.tool.state == ServoState::kNormal ? 0 : 1;
      cheaper += sample.cheaper ? 1 : 0;
      first_overruns = std::min(first_overruns, sample.overruns);
      overruns = sample.overruns - first_overruns;
    }
    const std::string stem = std::string("haptics.live.") + part.name + ".";
    report->Add(stem + "ticks_not_normal", unusual, "1");
    report->Add(stem + "ticks_cheaper", cheaper, "1");
    report->Add(stem + "overruns", static_cast<double>(overruns), "1");
  }
  report->Add("haptics.live.physics_step_ms_p50", 1e-3 * static_cast<double>(step.p50_us), "ms");
  report->Add("haptics.live.physics_step_ms_p99", 1e-3 * static_cast<double>(step.p99_us), "ms");
}

int RunLive(benchmark::Report* report) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("bench_live." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  scene::WriteSceneFile(scene::BuildProcedural(LiveScene()), "name: built-in\n", folder / "scene");
  const scene::SceneFile file(folder / "scene");
  TimingSummary step;
  const std::vector<Sample> samples = Record(file.view(), folder, &step);
  std::filesystem::remove_all(folder);
  if (samples.empty()) {
    std::fprintf(stderr, "bench_live: haptics_node and physics_node did not come up within %.0f s\n", kPatience_s);
    return 1;
  }
  AddErrors(file.view(), "live", samples, report);
  AddLateness(samples, step, report);
  return 0;
}

void RunSimulated(bool late, benchmark::Report* report) {
  const scene::SceneData data = scene::BuildProcedural(LiveScene());
  const SceneView scene = data.View();
  AddErrors(scene, late ? "late" : "in_time", Simulate(scene, late), report);
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (report.Wants("haptics.in_time")) fulcrum::RunSimulated(false, &report);
  if (report.Wants("haptics.late")) fulcrum::RunSimulated(true, &report);
  return report.Wants("haptics.live") ? fulcrum::RunLive(&report) : 0;
}
