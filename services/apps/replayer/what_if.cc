#include "services/apps/replayer/what_if.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>

#include "services/apps/replayer/coupled_nodes.h"
#include "services/apps/replayer/session_facts.h"
#include "services/apps/replayer/tick_source.h"
#include "services/base/core/contact_force.h"
#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::replay {
namespace {

/// Sum of squares and number of values.
struct Spread {
  double sum = 0;
  std::uint64_t count = 0;
  void Add(double squared) {
    sum += squared;
    ++count;
  }
  [[nodiscard]] double rms() const { return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count)); }
};

std::array<Vec3f, kMaxTools> TissueForces(const ContactModel& model) {
  std::array<Vec3f, kMaxTools> forces;
  for (std::size_t i = 0; i < forces.size(); ++i) forces[i] = TissueForce(model.devices[i]).cast<float>();
  return forces;
}

std::array<Vec3f, kMaxTools> HandForces(const ToolState& tools) {
  std::array<Vec3f, kMaxTools> forces;
  for (std::size_t i = 0; i < forces.size(); ++i) forces[i] = tools.tools[i].f_W;
  return forces;
}

void CompareForces(const std::array<Vec3f, kMaxTools>& before, const std::array<Vec3f, kMaxTools>& after, Pair* peak,
                   Spread* spread) {
  for (std::size_t i = 0; i < before.size(); ++i) {
    peak->before = std::max(peak->before, static_cast<double>(before[i].norm()));
    peak->after = std::max(peak->after, static_cast<double>(after[i].norm()));
    spread->Add((before[i] - after[i]).squaredNorm());
  }
}

/// Compares the two outcomes of each tick and collects the result.
class Comparison {
 public:
  void Add(const RecordedTick& tick, const Outcome& before, const Outcome& after) {
    ++result.ticks;
    if (before.state_hash != after.state_hash && result.first_difference_s < 0) {
      result.first_difference_s = tick.tick.session_time_s;
      result.first_node = tick.node;
    }
    if (before.frame && after.frame) AddFrames(tick, *before.frame, *after.frame);
    if (before.model && after.model) {
      CompareForces(TissueForces(*before.model), TissueForces(*after.model), &result.peak_tissue_force_N, &tissue_);
    }
    if (before.tools && after.tools) {
      CompareForces(HandForces(*before.tools), HandForces(*after.tools), &result.peak_hand_force_N, &hand_);
    }
    AddThermal(before, &Pair::before);
    AddThermal(after, &Pair::after);
  }

  void Finish() {
    result.rms_position_mm = 1e3 * position_.rms();
    result.rms_tissue_force_N = tissue_.rms();
    result.rms_hand_force_N = hand_.rms();
  }

  WhatIfResult result;

 private:
  void AddFrames(const RecordedTick& tick, const TissueFrame& before, const TissueFrame& after) {
    const std::size_t count = std::min(before.xyz.size(), after.xyz.size()) / 3;
    double largest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Map<const Vec3f> a(&before.xyz[3 * i]), b(&after.xyz[3 * i]);
      const double squared = (a - b).squaredNorm();
      position_.Add(squared);
      largest = std::max(largest, squared);
    }
    ++result.frames;
    if (1e3 * std::sqrt(largest) > result.max_position_mm) {
      result.max_position_mm = 1e3 * std::sqrt(largest);
      result.max_position_s = tick.tick.session_time_s;
    }
  }

  void AddThermal(const Outcome& outcome, double Pair::*side) {
    const auto raise = [side](Pair* pair, double value) { pair->*side = std::max(pair->*side, value); };
    if (outcome.topology) raise(&result.cut_length_mm, 1e3 * outcome.topology->cut_length_m);
    if (outcome.patch) raise(&result.highest_temperature_C, outcome.patch->header.max_temperature_C);
    for (const ThermalEvent& event : outcome.events) {
      const bool injury = event.kind == ThermalEventKind::kUreterInjury || event.kind == ThermalEventKind::kNerveInjury;
      result.injuries.*side += injury ? 1 : 0;
      if (event.kind != ThermalEventKind::kSolidBurn) continue;
      // Each event has the whole area of its solid.
      double& of_solid = burnt_mm2_[event.solid].*side;
      const double grown = std::max(0.0, 1e6 * static_cast<double>(event.value) - of_solid);
      of_solid += grown;
      result.burnt_mm2.*side += grown;
    }
  }

  std::map<std::uint8_t, Pair> burnt_mm2_;  ///< By solid.

  Spread position_, tissue_, hand_;
};

}  // namespace

WhatIfResult ReplayWhatIf(const LockStepSettings& settings, const SceneView& before, const SceneView& after,
                          const config::CartConfig& cart, const std::function<void(double)>& progress) {
  TickSource source(settings.recording, settings.nodes, NodePeriods(cart));
  CoupledNodes nodes_before(settings.nodes, {before, cart, settings.folder / "before", 1});
  CoupledNodes nodes_after(settings.nodes, {after, cart, settings.folder / "after", 1});
  Comparison comparison;
  RecordedTick tick;
  const std::int64_t begin = runtime::MonotonicNs();
  double first_s = -1, told_s = 0;
  while (source.Next(&tick)) {
    RefuseOtherScene(settings.recording, source.session(), before);
    const double time = tick.tick.session_time_s;
    if (settings.until_s >= 0 && time > settings.until_s) break;
    if (!tick.missing.empty()) {
      comparison.result.missing = tick.missing;
      break;
    }
    if (first_s < 0) first_s = time;
    const Outcome was = nodes_before.Step(tick);
    const Outcome would_be = nodes_after.Step(tick);
    comparison.Add(tick, was, would_be);
    comparison.result.session_s = time - first_s;
    if (progress && time > told_s + 0.1) {
      told_s = time;
      progress(time);
    }
  }
  comparison.Finish();
  comparison.result.wall_s = 1e-9 * static_cast<double>(runtime::MonotonicNs() - begin);
  if (const auto faults = source.Faults(); comparison.result.missing.empty() && !faults.empty()) {
    comparison.result.missing = "the recording, " + faults[0];
  }
  if (comparison.result.ticks == 0 && comparison.result.missing.empty()) {
    comparison.result.missing = "the recording contains no tick of these nodes";
  }
  return comparison.result;
}

}  // namespace fulcrum::replay
