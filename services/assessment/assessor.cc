#include "services/assessment/assessor.h"

#include <algorithm>
#include <limits>

namespace fulcrum::assessment {
namespace {

// How long a prompt stays after its last cause [s]: what goes on, what has happened, what must not be missed.
constexpr double kStays_s = 0.5, kHappened_s = 2, kGrave_s = 5;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::size_t At(Measure measure) { return static_cast<std::size_t>(measure); }

}  // namespace

Assessor::Assessor(const SceneView& scene)
    : scene_(scene),
      motion_(scene.assessment),
      force_(scene.assessment, scene.physics),
      line_(scene),
      damage_(line_.line(), static_cast<double>(scene.assessment.margin_m),
              static_cast<double>(scene.membrane.texel_m)) {
  prompt_until_s_.fill(-1);
}

void Assessor::Begin(std::int64_t session_start_ns) {
  begun_ = true;
  start_ns_ = session_start_ns;
}

void Assessor::End(double session_time_s) { end_s_ = session_time_s; }

double Assessor::TimeOf(const Stamp& stamp) const { return 1e-9 * static_cast<double>(stamp.stamp_ns - start_ns_); }

void Assessor::Raise(Prompt prompt, double until_s) {
  double& until = prompt_until_s_[static_cast<std::size_t>(prompt)];
  until = std::max(until, until_s);
}

void Assessor::Add(const ToolState& state) {
  if (const double time_s = TimeOf(state.stamp); Counts(time_s)) motion_.Add(time_s, state);
}

void Assessor::Add(const ContactModel& model) {
  const double time_s = TimeOf(model.stamp);
  if (!Counts(time_s)) return;
  const ForceMeter::Finding finding = force_.Add(time_s, model);
  if (finding.too_high) Raise(Prompt::kForceTooHigh, time_s + kStays_s);
  if (finding.slips) Raise(Prompt::kGraspSlips, time_s + kHappened_s);
}

void Assessor::Add(const CauteryContact& contact) {
  const double time_s = contact.session_time_s;
  if (!Counts(time_s)) return;
  const LineMeter::Finding finding = line_.Add(contact);
  if (finding.pedal_without_contact) Raise(Prompt::kPedalWithoutContact, time_s + kStays_s);
  if (finding.off_line) Raise(Prompt::kOffLine, time_s + kStays_s);
  if (finding.ureter_near) Raise(Prompt::kUreterNear, time_s + kStays_s);
  if (finding.nerve_near) Raise(Prompt::kNerveNear, time_s + kStays_s);
}

void Assessor::Add(const ThermalEvent& event) {
  const double time_s = event.session_time_s;
  if (!Counts(time_s)) return;
  switch (event.kind) {
    case ThermalEventKind::kUreterWarning:
      ++alarms_[0];
      Raise(Prompt::kUreterHot, time_s + kHappened_s);
      break;
    case ThermalEventKind::kNerveWarning:
      ++alarms_[2];
      Raise(Prompt::kNerveHot, time_s + kHappened_s);
      break;
    case ThermalEventKind::kUreterInjury:
    case ThermalEventKind::kNerveInjury:
      ++alarms_[event.kind == ThermalEventKind::kUreterInjury ? 1 : 3];
      Raise(Prompt::kInjury, time_s + kGrave_s);
      break;
    default:
      break;
  }
}

void Assessor::Add(const TopologyState& topology) {
  // A thermal node that comes back says first what it was told.
  if (Counts(TimeOf(topology.stamp))) {
    cut_length_m_ = std::max(cut_length_m_, static_cast<double>(topology.cut_length_m));
  }
}

void Assessor::Add(const TemperaturePatch& patch) {
  if (Counts(TimeOf(patch.header.stamp))) damage_.Add(patch);
}

Figures Assessor::figures() const {
  Figures figures;
  figures.session.fill(kNone);
  double first_s = std::numeric_limits<double>::infinity(), last_s = 0, smoothness = 0;
  double path_m = 0, force_time_Ns = 0, peak_N = 0, lift_m = 0, lift_hold_s = 0;
  int movements = 0, smooth_movements = 0, slips = 0;
  for (int i = 0; i < kMaxTools; ++i) {
    MeasureValues& own = figures.tool[static_cast<std::size_t>(i)];
    own.fill(kNone);
    const ToolMotion& motion = motion_.tool(i);
    const ToolForce& force = force_.tool(i);
    const ToolKind kind = scene_.tools[static_cast<std::size_t>(i)].kind;
    if (kind == ToolKind::kNone) continue;
    own[At(Measure::kTime)] = motion.first_s < 0 ? 0 : motion.last_s - motion.first_s;
    own[At(Measure::kPathLength)] = 1e3 * motion.path_m;
    own[At(Measure::kMovements)] = motion.movements;
    own[At(Measure::kIdle)] = motion.idle.total_s();
    if (motion.smoothness_count > 0) own[At(Measure::kSmoothness)] = motion.smoothness_sum / motion.smoothness_count;
    own[At(Measure::kForceTime)] = force.force_time_Ns;
    own[At(Measure::kPeakForce)] = force.peak_N;
    if (kind == ToolKind::kGrasper) {
      own[At(Measure::kGraspSlips)] = force.slips;
      own[At(Measure::kLift)] = 1e3 * force.lift_m;
      own[At(Measure::kLiftHold)] = force.lift_hold_s;
    }
    if (motion.first_s >= 0) {
      first_s = std::min(first_s, motion.first_s);
      last_s = std::max(last_s, motion.last_s);
    }
    path_m += motion.path_m;
    movements += motion.movements;
    smoothness += motion.smoothness_sum;
    smooth_movements += motion.smoothness_count;
    force_time_Ns += force.force_time_Ns;
    peak_N = std::max(peak_N, force.peak_N);
    slips += force.slips;
    lift_m = std::max(lift_m, force.lift_m);
    lift_hold_s = std::max(lift_hold_s, force.lift_hold_s);
  }
  const auto has = [&](ToolKind kind) {
    return std::any_of(scene_.tools.begin(), scene_.tools.end(), [&](const auto& tool) { return tool.kind == kind; });
  };
  const auto set = [&](Measure measure, double value) { figures.session[At(measure)] = value; };
  set(Measure::kTime, std::max(0.0, last_s - first_s));
  set(Measure::kPathLength, 1e3 * path_m);
  set(Measure::kMovements, movements);
  set(Measure::kIdle, motion_.idle_s());
  if (smooth_movements > 0) set(Measure::kSmoothness, smoothness / smooth_movements);
  set(Measure::kForceTime, force_time_Ns);
  set(Measure::kPeakForce, peak_N);
  if (has(ToolKind::kGrasper)) {
    set(Measure::kGraspSlips, slips);
    set(Measure::kLift, 1e3 * lift_m);
    set(Measure::kLiftHold, lift_hold_s);
  }
  if (has(ToolKind::kHook)) {
    set(Measure::kPedalWithoutContact, line_.pedal_without_contact_s());
    set(Measure::kCutLength, 1e3 * cut_length_m_);
    set(Measure::kUreterWarnings, alarms_[0]);
    set(Measure::kUreterInjuries, alarms_[1]);
    set(Measure::kNerveWarnings, alarms_[2]);
    set(Measure::kNerveInjuries, alarms_[3]);
    if (!line_.line().empty()) {
      set(Measure::kLineDone, 100 * line_.done());
      if (const auto mean = line_.deviation_mean_m()) set(Measure::kDeviationMean, 1e3 * *mean);
      if (const auto most = line_.deviation_max_m()) set(Measure::kDeviationMax, 1e3 * *most);
      set(Measure::kDamageBeyondMargin, 1e6 * damage_.beyond_margin_m2());
    }
  }
  return figures;
}

std::uint32_t Assessor::PromptsAt(double session_time_s) const {
  std::uint32_t prompts = 0;
  for (std::size_t i = 0; i < kPromptCount; ++i) {
    prompts |= prompt_until_s_[i] > session_time_s ? 1u << i : 0u;
  }
  return prompts;
}

}  // namespace fulcrum::assessment
