// The servo's time and its error.
//   servo.wake_late_us_*   lateness of a real 1 kHz thread that runs the node's servo step with models arriving
//   servo.step_us_*        duration of that step
//   servo.busy_step_us_*   the same with four contacts on each tool, a model every 10 ms replayed over 20 ms
//   haptics.MOTION.*       force against tissue integrated at 20 us, with models 10 to 20 ms old: RMS error in per cent
//                          of the RMS force, for this servo, for parameters 30 % too high, and for holding the last
//                          reported force (the paper's way); and the largest step of a tick that the tissue did not
//                          make
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "haptics_node/node/haptics_node.h"
#include "haptics_node/servo/servo.h"
#include "services/bus/in_process.h"
#include "services/runtime/cyclic_thread.h"
#include "services/runtime/realtime.h"
#include "tests/benchmark/report.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {
namespace {

using benchmark::Report;
using testing::BenchScene;
using testing::BenchTrocar;
using testing::GuidedDevice;
using testing::LatePhysics;
using testing::TestTissue;
using testing::TickAt;
using testing::TissueParameters;

constexpr int kServoPriority = 80;

// ---------------------------------------------------------------------------------------------------- timing

/// Both tools on the move, one contact each: what a session asks of the servo.
std::array<ScriptKey, 4> MovingScript() {
  return {{{0.0f, 0, Vec3f(0, 0, 0.0f), 0, 0, 0},
           {10.0f, 0, Vec3f(0.05f, 0, -0.005f), 0, 0, 0},
           {0.0f, 1, Vec3f(0, 0, 0.0f), 0, 0, 0},
           {10.0f, 1, Vec3f(-0.05f, 0, -0.005f), 0, 0, 0}}};
}

void RunThread(Report* report, double seconds) {
  const std::array<ScriptKey, 4> script = MovingScript();
  SceneView scene = BenchScene(0.3);
  scene.tools[1] = scene.tools[0];
  scene.script = script;
  bus::InProcessTopic<ContactModel> models;
  bus::InProcessTopic<ToolState> tools;
  bus::InProcessTopic<TickManifest> manifests;
  const auto model_out = models.MakeOutput();
  const auto model_in = models.MakeInput();
  const auto tool_out = tools.MakeOutput();
  const auto manifest_out = manifests.MakeOutput();
  const auto tool_in = tools.MakeInput();
  HapticsNode node(scene, {true, true}, {*model_in, *tool_out, *manifest_out}, runtime::MonotonicNs());

  const std::string memory = runtime::LockMemory();
  std::fprintf(stderr, "servo: %s\n", memory.empty() ? "memory is locked" : memory.c_str());
  std::string fifo;
  const std::int64_t start = runtime::MonotonicNs();
  runtime::CyclicThread servo({.name = "servo", .period_ns = 1'000'000, .spin_ns = 50'000}, [&](const Tick& tick) {
    if (tick.index == 0) fifo = runtime::SetFifoPriority(kServoPriority);
    Tick timed = tick;
    timed.session_time_s = 1e-9 * static_cast<double>(tick.stamp_ns - start);
    node.ServoStep(timed);
  });
  const TestTissue tissue({});
  std::uint64_t sequence = 0;
  ToolState tool;
  runtime::CyclicThread physics({.name = "physics", .period_ns = 10'000'000}, [&](const Tick& tick) {
    if (!tool_in->TakeLatest(&tool)) return;
    ContactModel model;
    model.stamp = {++sequence, 1, tick.stamp_ns};
    model.tool_stamp_ns = tool.stamp.stamp_ns;
    for (std::size_t i = 0; i < 2; ++i) {
      model.devices[i].count = 1;
      model.devices[i].contacts[0] = tissue.Report();
      model.devices[i].contacts[0].x_ref = tool.tools[i].p_WT;
      model.devices[i].contacts[0].gap = 0;
      model.devices[i].contacts[0].f_ref = Vec3f(0.1f, 0, 1.0f);
    }
    model_out->Write(model);
  });
  runtime::CyclicThread bus({.name = "bus", .period_ns = 1'000'000}, [&](const Tick&) { node.BusStep(); });
  bus.Start();
  physics.Start();
  servo.Start();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  servo.Stop();
  const runtime::CyclicStats stats = servo.stats();
  std::fprintf(stderr, "servo: %s; %llu ticks, %llu periods skipped, %llu models\n",
               fifo.empty() ? "SCHED_FIFO 80, spin 50 us" : fifo.c_str(), static_cast<unsigned long long>(stats.ticks),
               static_cast<unsigned long long>(stats.overruns), static_cast<unsigned long long>(sequence));
  report->Add("servo.wake_late_us_p50", 1e-3 * static_cast<double>(stats.wake.Quantile(0.5)), "us");
  report->Add("servo.wake_late_us_p99", 1e-3 * static_cast<double>(stats.wake.Quantile(0.99)), "us");
  report->Add("servo.wake_late_us_p999", 1e-3 * static_cast<double>(stats.wake.Quantile(0.999)), "us");
  report->Add("servo.step_us_p50", 1e-3 * static_cast<double>(stats.step.Quantile(0.5)), "us");
  report->Add("servo.step_us_p99", 1e-3 * static_cast<double>(stats.step.Quantile(0.99)), "us");
}

void RunBusy(Report* report, int ticks) {
  SceneView scene = BenchScene(0.3);
  scene.tools[1] = scene.tools[0];
  GuidedDevice device(BenchTrocar(), [](double t) { return Vec3d(0.01 * std::sin(t), 0, -0.004); });
  Servo servo(scene, {&device, &device});
  const TestTissue tissue({});
  std::vector<double> times;
  for (int i = 0; i < ticks; ++i) {
    const Tick tick = TickAt(static_cast<std::uint64_t>(i));
    const auto start = std::chrono::steady_clock::now();
    if (i % 10 == 0) {
      ContactModel model;
      model.stamp = {static_cast<std::uint64_t>(i) + 1, 1, tick.stamp_ns};
      model.tool_stamp_ns = tick.stamp_ns - 20'000'000;
      for (DeviceContacts& contacts : model.devices) {
        contacts.count = kMaxContacts;
        contacts.contacts.fill(tissue.Report());
        for (std::uint32_t k = 0; k < kMaxContacts; ++k) contacts.contacts[k].id = k;
      }
      servo.OfferModel(model, tick.stamp_ns);
    }
    servo.Step(tick);
    const std::chrono::duration<double, std::micro> elapsed = std::chrono::steady_clock::now() - start;
    times.push_back(elapsed.count());
  }
  report->Add("servo.busy_step_us_p50", benchmark::Quantile(times, 0.5), "us");
  report->Add("servo.busy_step_us_p99", benchmark::Quantile(times, 0.99), "us");
}

// ----------------------------------------------------------------------------------------------------- error

struct ForceError {
  double percent = 0, held_percent = 0, excess_step_N = 0;
};

/// @param parameter_scale what physics believes of k1, kt, Kb, Bb over what is true.
ForceError FollowMotion(const std::function<Vec3d(double)>& tip, const TissueParameters& parameters,
                        double parameter_scale) {
  constexpr int kSettle = 1000;  // Three models, the rise to full force, and a whole cycle.
  constexpr int kMeasured = 4000;
  GuidedDevice device(BenchTrocar(), tip);
  Servo servo(BenchScene(1.0), {&device, nullptr});
  TestTissue tissue(parameters);
  tissue.Place(tip(0));
  LatePhysics physics;
  double error2 = 0;
  double held2 = 0;
  double force2 = 0;
  double worst = 0;
  Vec3d held = Vec3d::Zero();
  Vec3d last_error = Vec3d::Zero();
  for (int i = 0; i < kSettle + kMeasured; ++i) {
    const Tick tick = TickAt(static_cast<std::uint64_t>(i));
    ContactModel model;
    if (physics.Step(tissue, tick.stamp_ns - 1'000'000, &model)) {
      Contact& contact = model.devices[0].contacts[0];
      held = contact.f_ref.cast<double>();
      for (float* value : {&contact.k1, &contact.k3, &contact.kt, &contact.k_body, &contact.b_body}) {
        *value *= static_cast<float>(parameter_scale);
      }
      servo.OfferModel(model, tick.stamp_ns);
    }
    servo.Step(tick);
    const Vec3d truth = tissue.Step(servo.record().tool.tools[0].p_WT.cast<double>(), tick.dt_s);
    const Vec3d error = testing::SentForce(servo) - truth;
    if (i >= kSettle) {
      error2 += error.squaredNorm();
      held2 += (held - truth).squaredNorm();
      force2 += truth.squaredNorm();
      worst = std::max(worst, (error - last_error).norm());
    }
    last_error = error;
  }
  return {100 * std::sqrt(error2 / force2), 100 * std::sqrt(held2 / force2), worst};
}

struct Motion {
  const char* name;
  std::function<Vec3d(double)> tip;
  TissueParameters parameters;
};

std::vector<Motion> Motions() {
  constexpr double kPi = 3.14159265358979323846;
  TissueParameters grasp;
  grasp.grasp = true;
  return {
      {"press_hold",
       [](double t) {
         const double u = std::fmod(t, 1.0);  // Down in 150 ms, hold, up, hold.
         const double ramp = std::clamp(std::min(u, 0.65 - u) / 0.15, 0.0, 1.0);
         return Vec3d(0, 0, 0.001 - 0.007 * ramp * ramp * (3 - 2 * ramp));
       },
       {}},
      {"palpate_2Hz", [=](double t) { return Vec3d(0, 0, -0.004 + 0.003 * std::cos(2 * kPi * 2 * t)); }, {}},
      {"tap_5Hz", [=](double t) { return Vec3d(0, 0, 0.003 * std::cos(2 * kPi * 5 * t)); }, {}},
      {"slide_60mm_s",
       [](double t) {
         const double u = std::fmod(t, 2.0);
         return Vec3d(0.06 * (u < 1 ? u : 2 - u), 0, -0.004);
       },
       {}},
      {"grasp_pull",
       [=](double t) {
         const double pull = 0.004 * (1 - std::cos(2 * kPi * 0.7 * t));
         return Vec3d(0.3 * pull, 0.2 * pull, 0.6 * pull);
       },
       grasp},
  };
}

void RunMotions(Report* report) {
  for (const Motion& motion : Motions()) {
    const std::string stem = std::string("haptics.") + motion.name;
    if (!report->Wants(stem)) continue;
    const ForceError matched = FollowMotion(motion.tip, motion.parameters, 1.0);
    const ForceError off = FollowMotion(motion.tip, motion.parameters, 1.3);
    report->Add(stem + ".force_error_pct", matched.percent, "%");
    report->Add(stem + ".mismatched_error_pct", off.percent, "%");
    report->Add(stem + ".held_force_error_pct", matched.held_percent, "%");
    report->Add(stem + ".excess_step_N", matched.excess_step_N, "N");
    report->Add(stem + ".mismatched_excess_step_N", off.excess_step_N, "N");
  }
}

}  // namespace
}  // namespace fulcrum::haptics

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (report.Wants("servo.wake") || report.Wants("servo.step")) {
    fulcrum::haptics::RunThread(&report, report.quick() ? 1.5 : 5.0);
  }
  if (report.Wants("servo.busy")) fulcrum::haptics::RunBusy(&report, report.quick() ? 5000 : 20000);
  if (report.Wants("haptics")) fulcrum::haptics::RunMotions(&report);
  return 0;
}
