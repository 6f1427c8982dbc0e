// The servo's time, its error and its stability; writes force_error.svg.
//   servo.wake_late_us_*       lateness of a real 1 kHz thread that runs the node's servo step with models arriving
//   servo.wake_late_ratio_p99  the same over a bare thread that only sleeps and spins, in turns with it
//   servo.step_us_*            duration of that step
//   servo.busy_step_us_*       the same with four contacts on each tool, a model every 10 ms replayed over 20 ms
//   haptics.force_error_pct.*  force against tissue integrated at 20 us, with models every 10 ms, 10 to 20 ms old: RMS
//                              error in per cent of the RMS force. mismatch30: worst motion with physics' stiffnesses
//                              and viscosities each 30 % high or low; mismatch30_first: the same in the first cycle
//                              after the start; noise2: worst motion with 2 % noise on each reference force
//   haptics.paper_force_error_pct.*  depth x normal held from one physics step to the next, on the same runs
//   haptics.excess_step_N      largest step of a tick that the tissue did not make, worst motion
//   haptics.z_width_N_per_mm.GRIP.*  stiffest wall on which the hand comes to rest; stiffness then rendered
//   haptics.energy_per_cycle_mJ.*    energy that the hand loses in a cycle; leak: its negative over the energy stored
//   haptics.stall_1s.*         physics stops for a second
#include <sys/prctl.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "haptics_node/node/haptics_node.h"
#include "haptics_node/servo/servo.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "tests/benchmark/report.h"
#include "tests/benchmark/servo/force_plot.h"
#include "tests/benchmark/servo/motions.h"
#include "tests/benchmark/servo/stability.h"
#include "tests/benchmark/servo/strategies.h"
#include "tests/unit/haptics/node_bus.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {
namespace {

using benchmark::Report;
using testing::BenchScene;
using testing::BenchTrocar;
using testing::GuidedDevice;
using testing::TestTissue;
using testing::TickAt;

constexpr int kServoPriority = 80;
constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::int64_t kSpin_ns = 50'000;

// ---------------------------------------------------------------------------------------------------- timing

/// Both tools move with one contact each: the load of a session on the servo.
std::array<ScriptKey, 4> MovingScript() {
  return {{{0.0f, 0, Vec3f(0, 0, 0.0f), 0, 0, 0},
           {10.0f, 0, Vec3f(0.05f, 0, -0.005f), 0, 0, 0},
           {0.0f, 1, Vec3f(0, 0, 0.0f), 0, 0, 0},
           {10.0f, 1, Vec3f(-0.05f, 0, -0.005f), 0, 0, 0}}};
}

/// Lateness [ns] of a thread that does nothing but sleep and spin, at the servo's priority and rate.
std::vector<double> BareLateness(double seconds) {
  std::vector<double> late;
  late.reserve(static_cast<std::size_t>(1e3 * seconds) + 1);
  std::thread thread([&] {
    prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
    (void)runtime::SetFifoPriority(kServoPriority);
    std::int64_t wake = runtime::MonotonicNs() + kPeriod_ns;
    const std::int64_t end = wake + static_cast<std::int64_t>(1e9 * seconds);
    while (wake < end) {
      const std::int64_t sleep_end = wake - kSpin_ns;
      const timespec until{sleep_end / 1'000'000'000, sleep_end % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
      std::int64_t now = runtime::MonotonicNs();
      while (now < wake) now = runtime::MonotonicNs();
      late.push_back(static_cast<double>(now - wake));
      wake = runtime::PlanNextPeriod(wake, kPeriod_ns, now).wake_ns;
    }
  });
  thread.join();
  return late;
}

void Merge(const runtime::HistogramSnapshot& from, runtime::HistogramSnapshot* into) {
  for (std::size_t i = 0; i < from.bins.size(); ++i) into->bins[i] += from.bins[i];
  into->count += from.count;
  into->max_ns = std::max(into->max_ns, from.max_ns);
}

/// The node's servo and a bare loop take turns, so that both run under the same load of the machine.
void RunThread(Report* report, int rounds, double seconds) {
  const std::array<ScriptKey, 4> script = MovingScript();
  SceneView scene = BenchScene(0.3);
  scene.tools[1] = scene.tools[0];
  scene.script = script;
  const testing::NodeBus bus;
  HapticsNode node(scene, {true, true}, bus.ports(), runtime::MonotonicNs());

  const std::string memory = runtime::LockMemory();
  std::fprintf(stderr, "servo: %s\n", memory.empty() ? "memory is locked" : memory.c_str());
  const TestTissue tissue({});
  std::uint64_t sequence = 0;
  ToolState tool;
  runtime::CyclicThread physics({.name = "physics", .period_ns = 10'000'000}, [&](const Tick& tick) {
    if (!bus.tool_in->TakeLatest(&tool)) return;
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
    bus.model_out->Write(model);
  });
  runtime::CyclicThread bus_thread({.name = "bus", .period_ns = kPeriod_ns}, [&](const Tick&) { node.BusStep(); });
  bus_thread.Start();
  physics.Start();

  std::string refused;
  const std::int64_t start = runtime::MonotonicNs();
  runtime::HistogramSnapshot wake, step;
  std::uint64_t skipped = 0;
  std::vector<double> node_p99, bare_p99;
  for (int round = 0; round < rounds; ++round) {
    runtime::CyclicThread servo({.name = "servo", .period_ns = kPeriod_ns, .spin_ns = kSpin_ns}, [&](const Tick& tick) {
      if (tick.index == 0) refused = runtime::SetFifoPriority(kServoPriority);
      Tick timed = tick;
      timed.session_time_s = 1e-9 * static_cast<double>(tick.stamp_ns - start);
      node.ServoStep(timed);
    });
    servo.Start();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    servo.Stop();
    const runtime::CyclicStats stats = servo.stats();
    Merge(stats.wake, &wake);
    Merge(stats.step, &step);
    skipped += stats.overruns;
    node_p99.push_back(static_cast<double>(stats.wake.Quantile(0.99)));
    bare_p99.push_back(benchmark::Quantile(BareLateness(seconds), 0.99));
  }
  std::fprintf(stderr, "servo: %s; %llu ticks, %llu periods skipped, %llu models\n",
               refused.empty() ? "SCHED_FIFO 80, spin 50 us" : refused.c_str(),
               static_cast<unsigned long long>(wake.count), static_cast<unsigned long long>(skipped),
               static_cast<unsigned long long>(sequence));
  const double node_late = benchmark::Quantile(node_p99, 0.5), bare_late = benchmark::Quantile(bare_p99, 0.5);
  report->Add("servo.wake_late_us_p50", 1e-3 * static_cast<double>(wake.Quantile(0.5)), "us");
  report->Add("servo.wake_late_us_p99", 1e-3 * node_late, "us");
  report->Add("servo.wake_late_us_p999", 1e-3 * static_cast<double>(wake.Quantile(0.999)), "us");
  report->Add("servo.bare_wake_late_us_p99", 1e-3 * bare_late, "us");
  report->Add("servo.wake_late_ratio_p99", node_late / bare_late, "1");
  report->Add("servo.step_us_p50", 1e-3 * static_cast<double>(step.Quantile(0.5)), "us");
  report->Add("servo.step_us_p99", 1e-3 * static_cast<double>(step.Quantile(0.99)), "us");
}

void RunBusy(Report* report, int ticks) {
  SceneView scene = BenchScene(0.3);
  scene.tools[1] = scene.tools[0];
  GuidedDevice device(BenchTrocar(), [](double t) { return Vec3d(0.01 * std::sin(t), 0, -0.004); });
  Servo servo(ServoSettingsOf(scene), {&device, &device});
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

// -------------------------------------------------------------------------------------------------- accuracy

using MakeStrategy = std::unique_ptr<ForceStrategy>();

ForceError Measure(const Motion& motion, const Physics& physics, MakeStrategy* make) {
  const std::unique_ptr<ForceStrategy> strategy = make();
  return Follow(motion, physics, strategy.get());
}

void RunMotions(Report* report) {
  double worst_step = 0;
  for (const Motion& motion : Motions()) {
    const ForceError error = Measure(motion, {}, MakeServo);
    worst_step = std::max(worst_step, error.excess_step_N);
    report->Add(std::string("haptics.force_error_pct.") + motion.name, error.percent, "%");
    report->Add(std::string("haptics.paper_force_error_pct.") + motion.name, Measure(motion, {}, MakeHeldForce).percent,
                "%");
  }
  report->Add("haptics.excess_step_N", worst_step, "N");
}

void RunMismatch(Report* report) {
  ForceError worst;
  for (const Motion& motion : Motions()) {
    ForceError of_motion;
    for (const double stiffness : {0.7, 1.3}) {
      for (const double viscosity : {0.7, 1.3}) {
        Physics physics;
        physics.mismatch = {stiffness, viscosity};
        const ForceError error = Measure(motion, physics, MakeServo);
        of_motion.percent = std::max(of_motion.percent, error.percent);
        of_motion.first_percent = std::max(of_motion.first_percent, error.first_percent);
        of_motion.excess_step_N = std::max(of_motion.excess_step_N, error.excess_step_N);
      }
    }
    std::fprintf(stderr, "haptics: %-8s 30 %% off: %.2f %%, first cycle %.2f %%, step %.4f N\n", motion.name,
                 of_motion.percent, of_motion.first_percent, of_motion.excess_step_N);
    worst.percent = std::max(worst.percent, of_motion.percent);
    worst.first_percent = std::max(worst.first_percent, of_motion.first_percent);
    worst.excess_step_N = std::max(worst.excess_step_N, of_motion.excess_step_N);
  }
  report->Add("haptics.force_error_pct.mismatch30", worst.percent, "%");
  report->Add("haptics.force_error_pct.mismatch30_first", worst.first_percent, "%");
  report->Add("haptics.excess_step_N.mismatch30", worst.excess_step_N, "N");

  ForceError noisy;
  for (const Motion& motion : Motions()) {
    Physics physics;
    physics.noise = 0.02;
    const ForceError error = Measure(motion, physics, MakeServo);
    noisy.percent = std::max(noisy.percent, error.percent);
    noisy.excess_step_N = std::max(noisy.excess_step_N, error.excess_step_N);
  }
  report->Add("haptics.force_error_pct.noise2", noisy.percent, "%");
  report->Add("haptics.excess_step_N.noise2", noisy.excess_step_N, "N");
}

// ------------------------------------------------------------------------------------------------- stability

void RunZWidth(Report* report) {
  const std::pair<const char*, HandModel> hands[] = {
      {"fingertip", kFingertip}, {"light_grip", kLightGrip}, {"firm_grip", kFirmGrip}};
  // Up to the stiffest skin that the gate admits.
  const double walls[] = {0.3, 0.6, 0.9, 1.2, 1.6, 2, 3, 4, 6, 8, 10, 12, 14, 16, 18, 20};
  for (const auto& [name, hand] : hands) {
    double stable_up_to = 0;
    double rendered = 0;
    for (const double wall : walls) {
      const WallResult result = HitWall(hand, wall);
      if (!result.stable) break;
      stable_up_to = wall;
      rendered = result.rendered_N_per_mm;
    }
    const std::string stem = std::string("haptics.z_width_N_per_mm.") + name;
    report->Add(stem + ".stable", stable_up_to, "N/mm");
    report->Add(stem + ".rendered", rendered, "N/mm");
  }
}

void RunEnergy(Report* report) {
  const CycleEnergy tissue = CycleOnTissue(), wall = CycleOnElasticWall();
  report->Add("haptics.energy_per_cycle_mJ.tissue", tissue.lost_mJ, "mJ");
  report->Add("haptics.energy_per_cycle_mJ.elastic_wall", wall.lost_mJ, "mJ");
  report->Add("haptics.energy_per_cycle_mJ.elastic_wall_leak_pct", -100 * wall.lost_mJ / wall.stored_mJ, "%");
}

void RunStall(Report* report) {
  const StallResult stall = StallForASecond();
  report->Add("haptics.stall_1s.pressed_N", stall.pressed_N, "N");
  report->Add("haptics.stall_1s.force_at_400ms_N", stall.force_at_400ms_N, "N");
  report->Add("haptics.stall_1s.return_step_N_per_5ms", stall.return_step_N_per_5ms, "N");
  report->Add("haptics.stall_1s.returned_N", stall.returned_N, "N");
}

// ------------------------------------------------------------------------------------------------------ plot

void WritePlot(bool quick) {
  const char* folder = std::getenv("FULCRUM_BENCH_OUT");
  const std::filesystem::path file = std::filesystem::path(folder != nullptr ? folder : "out") / "force_error.svg";
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << ForceErrorSvg(MeasureForcePlot(quick));
  std::fprintf(stderr, "haptics: wrote %s\n", file.c_str());
}

}  // namespace
}  // namespace fulcrum::haptics

int main(int argc, char** argv) {
  using namespace fulcrum::haptics;
  fulcrum::benchmark::Report report(argc, argv);
  if (report.Wants("servo.wake") || report.Wants("servo.bare") || report.Wants("servo.step")) {
    report.quick() ? RunThread(&report, 3, 0.5) : RunThread(&report, 7, 1.0);
  }
  if (report.Wants("servo.busy")) RunBusy(&report, report.quick() ? 5000 : 20000);
  if (report.Wants("haptics.force_error") || report.Wants("haptics.paper") || report.Wants("haptics.excess")) {
    RunMotions(&report);
    RunMismatch(&report);
    WritePlot(report.quick());
  }
  if (report.Wants("haptics.z_width")) RunZWidth(&report);
  if (report.Wants("haptics.energy")) RunEnergy(&report);
  if (report.Wants("haptics.stall")) RunStall(&report);
  return 0;
}
