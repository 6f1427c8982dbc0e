#include "services/session/assessment/assessor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "services/base/core/solid_charts.h"

namespace fulcrum::assessment {
namespace {

// Time for which a prompt stays after its last cause [s]: for a continuing state, for an event, for an injury.
constexpr double kStays_s = 0.5, kHappened_s = 2, kGrave_s = 5;

/// Longest wait of a contact for the pedal state of its time [s].
constexpr double kPedalLate_s = 1;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double DegreesOf(double rad) { return rad * 180 / std::numbers::pi; }

std::size_t At(Measure measure) { return static_cast<std::size_t>(measure); }

}  // namespace

Assessor::Assessor(const SceneView& scene)
    : scene_(scene),
      motion_(scene.assessment),
      force_(scene.assessment, scene.physics),
      line_(scene),
      scope_(scene),
      damage_(line_.line(), static_cast<double>(scene.assessment.margin_m), static_cast<double>(scene.membrane.texel_m),
              PlaceOfFirstSheet(scene)) {
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
  const double time_s = TimeOf(state.stamp);
  if (!Counts(time_s)) return;
  // What an assistant does is not the trainee's.
  ToolState own = state;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (Assists(i)) own.tools[i] = {};
  }
  motion_.Add(time_s, own);
  if (scope_.Add(time_s, state)) Raise(Prompt::kOffLine, time_s + kStays_s);
}

void Assessor::Add(const ContactModel& model) {
  const double time_s = TimeOf(model.stamp);
  if (!Counts(time_s)) return;
  ContactModel own = model;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (Assists(i)) own.devices[i] = {};
  }
  const ForceMeter::Finding finding = force_.Add(time_s, own);
  if (finding.too_high) Raise(Prompt::kForceTooHigh, time_s + kStays_s);
  if (finding.slips) Raise(Prompt::kGraspSlips, time_s + kHappened_s);
}

void Assessor::Add(const CauteryContact& contact) {
  if (!Counts(contact.session_time_s)) return;
  contacts_.push_back({contact.session_time_s, contact.touching, contact.material, false, contact.on_solid});
  MeasureContacts(false);
}

void Assessor::Add(const HandleState& state) {
  generator_.Add(state);
  MeasureContacts(false);
}

void Assessor::MeasureContacts(bool all) {
  while (!contacts_.empty()) {
    HookSample& contact = contacts_.front();
    const double time_s = contact.time_s;
    const std::int64_t ns = start_ns_ + std::llround(1e9 * time_s);
    const bool known = generator_.newest_pedal_ns() >= ns || contacts_.back().time_s - time_s > kPedalLate_s;
    if (!known && !all) return;
    contact.energised = generator_.At(ns).mode != CauteryMode::kOff;
    generator_.DropBefore(ns);
    const LineMeter::Finding finding = line_.Add(contact);
    if (finding.pedal_without_contact) Raise(Prompt::kPedalWithoutContact, time_s + kStays_s);
    if (finding.off_line && !by_view()) Raise(Prompt::kOffLine, time_s + kStays_s);
    if (finding.ureter_near) Raise(Prompt::kUreterNear, time_s + kStays_s);
    if (finding.nerve_near) Raise(Prompt::kNerveNear, time_s + kStays_s);
    contacts_.pop_front();
  }
}

void Assessor::Finish() {
  MeasureContacts(true);
  motion_.Finish();
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
    case ThermalEventKind::kSolidBurn: {
      if (event.solid >= kMaxSolids || !IsOrgan(scene_, event.solid)) break;
      double& burnt_m2 = burnt_m2_[event.solid];
      burnt_m2 = std::max(burnt_m2, static_cast<double>(event.value));
      Raise(Prompt::kOrganBurnt, time_s + kHappened_s);
      break;
    }
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
  // The first topology after a restart of thermal_node may have a smaller cut length.
  if (Counts(TimeOf(topology.stamp))) {
    cut_length_m_ = std::max(cut_length_m_, static_cast<double>(topology.cut_length_m));
    cut_width_m_ = static_cast<double>(topology.cut_width_m);
    cut_off_way_m_ = static_cast<double>(topology.cut_off_way_m);
  }
}

void Assessor::Add(const TemperaturePatch& patch) {
  if (Counts(TimeOf(patch.header.stamp))) damage_.Add(patch);
}

MeasureValues Assessor::ToolFigures(int i) const {
  MeasureValues own;
  own.fill(kNone);
  const ToolMotion& motion = motion_.tool(i);
  const ToolForce& force = force_.tool(i);
  const ToolKind kind = scene_.tools[static_cast<std::size_t>(i)].kind;
  if (kind == ToolKind::kNone || Assists(static_cast<std::size_t>(i))) return own;
  const bool touches = TouchesTissue(kind);
  const auto set = [&](Measure measure, double value) { own[At(measure)] = value; };
  set(Measure::kTime, motion.first_s < 0 ? 0 : motion.last_s - motion.first_s);
  set(Measure::kPathLength, 1e3 * motion.path_m);
  set(Measure::kMovements, motion.movements);
  set(Measure::kIdle, motion.idle.total_s());
  if (motion.smoothness_count > 0) set(Measure::kSmoothness, motion.smoothness_sum / motion.smoothness_count);
  if (touches) set(Measure::kForceTime, force.force_time_Ns);
  if (touches) set(Measure::kPeakForce, force.peak_N);
  if (kind == ToolKind::kGrasper) {
    set(Measure::kGraspSlips, force.slips);
    set(Measure::kLift, 1e3 * force.lift_m);
    set(Measure::kLiftHold, force.lift_hold_s);
  }
  return own;
}

void Assessor::SetOfMotion(MeasureValues* session) const {
  double first_s = std::numeric_limits<double>::infinity(), last_s = 0, smoothness = 0;
  int smooth_movements = 0;
  for (int i = 0; i < kMaxTools; ++i) {
    const ToolMotion& motion = motion_.tool(i);
    smoothness += motion.smoothness_sum;
    smooth_movements += motion.smoothness_count;
    if (motion.first_s < 0) continue;
    first_s = std::min(first_s, motion.first_s);
    last_s = std::max(last_s, motion.last_s);
  }
  (*session)[At(Measure::kTime)] = std::max(0.0, last_s - first_s);
  (*session)[At(Measure::kIdle)] = motion_.idle_s();
  if (smooth_movements > 0) (*session)[At(Measure::kSmoothness)] = smoothness / smooth_movements;
}

void Assessor::SetOfScope(MeasureValues* session) const {
  if (const auto tilt = scope_.horizon_rad()) (*session)[At(Measure::kHorizon)] = DegreesOf(*tilt);
  if (const auto smeared_s = scope_.smeared_s()) (*session)[At(Measure::kLensSmeared)] = *smeared_s;
  if (const auto off = scope_.off_centre_rad()) (*session)[At(Measure::kOffCentre)] = DegreesOf(*off);
}

void Assessor::SetOfLine(MeasureValues* session) const {
  const auto set = [&](Measure measure, double value) { (*session)[At(measure)] = value; };
  const LineMeter& line = by_view() ? scope_.line() : line_;
  if (line.line().empty()) return;
  set(Measure::kLineDone, 100 * line.done());
  if (const auto mean = line.deviation_mean_m()) set(Measure::kDeviationMean, 1e3 * *mean);
  if (const auto most = line.deviation_max_m()) set(Measure::kDeviationMax, 1e3 * *most);
}

void Assessor::SetOfHook(MeasureValues* session) const {
  const auto set = [&](Measure measure, double value) { (*session)[At(measure)] = value; };
  set(Measure::kPedalWithoutContact, line_.pedal_without_contact_s());
  set(Measure::kCutLength, 1e3 * cut_length_m_);
  set(Measure::kCutWidth, 1e3 * cut_width_m_);
  set(Measure::kCutOffWay, 1e3 * cut_off_way_m_);
  set(Measure::kUreterWarnings, alarms_[0]);
  set(Measure::kUreterInjuries, alarms_[1]);
  set(Measure::kNerveWarnings, alarms_[2]);
  set(Measure::kNerveInjuries, alarms_[3]);
  if (SolidsBurn(scene_)) set(Measure::kOrganBurn, 1e6 * std::accumulate(burnt_m2_.begin(), burnt_m2_.end(), 0.0));
  if (!line_.line().empty()) set(Measure::kDamageBeyondMargin, 1e6 * damage_.beyond_margin_m2());
}

Figures Assessor::figures() const {
  Figures figures;
  figures.session.fill(kNone);
  bool hook = false;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    figures.tool[i] = ToolFigures(static_cast<int>(i));
    hook |= scene_.tools[i].kind == ToolKind::kHook;
    for (std::size_t k = 0; k < kMeasureCount; ++k) {
      double& whole = figures.session[k];
      const double own = figures.tool[i][k];
      const auto measure = static_cast<Measure>(k);
      const bool highest = measure == Measure::kPeakForce || measure == Measure::kLift || measure == Measure::kLiftHold;
      if (!std::isnan(own)) whole = std::isnan(whole) ? own : highest ? std::max(whole, own) : whole + own;
    }
  }
  // The following measures are not sums over the tools.
  for (const Measure measure : {Measure::kTime, Measure::kIdle, Measure::kSmoothness}) {
    figures.session[At(measure)] = kNone;
  }
  SetOfMotion(&figures.session);
  if (hook) SetOfHook(&figures.session);
  if (hook || by_view()) SetOfLine(&figures.session);
  SetOfScope(&figures.session);
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
