#include "thermal_node/coupling/tip_tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fulcrum::thermal {

bool TipTracker::Accepts(const CauteryContact& sample) const {
  if (!std::isfinite(sample.session_time_s)) return false;
  if (!Touches(sample)) return true;
  const bool numbers =
      sample.material.allFinite() && std::isfinite(sample.contact_radius_m) && sample.contact_radius_m >= 0;
  return numbers && sheet_.OnSheet(sample.material) && sample.footprint.whole();
}

TipInput TipTracker::Advance(const CauteryContact& sample, const GeneratorDemand& demand, double dt_s) {
  TipInput input;
  // The duration of the first sample, of one after a gap and of one older than the last is a frame's time step.
  const double since_s = sample.session_time_s - last_s_;
  const bool follows = last_s_ >= 0 && since_s > 0 && since_s <= kLongestGap_s;
  // After a sample without current the time at which the pedal was pressed is unknown, so at most a frame is applied.
  input.duration_s = static_cast<float>(!follows ? dt_s : energised_ ? since_s : std::min(since_s, dt_s));
  on_path_ = on_path_ && follows;
  last_s_ = sample.session_time_s;
  if (!Touches(sample)) {
    on_path_ = energised_ = false;
    return input;
  }
  const float reach = kTipSpeedMax_m_s * std::max(input.duration_s, 0.01f);
  input.path.to = sample.material;
  input.path.end = sample.footprint;
  const bool jumped =
      !on_path_ || (sample.footprint.width > 0) != (print_.width > 0) || (sample.material - at_).norm() > reach;
  input.path.from = jumped ? sample.material : at_;
  input.path.begin = jumped ? sample.footprint : print_;
  input.path.displacement = input.path.to - input.path.from;
  const float radius = sample.contact_radius_m > 0 ? sample.contact_radius_m : default_radius_m_;
  input.path.radius_m = std::clamp(radius, kContactRadiusMin_m, kContactRadiusMax_m);
  input.path.tented = sample.tented;
  input.mode = demand.mode;
  input.power_W = demand.power_W;
  input.touching = true;
  input.active = input.power_W > 0;
  at_ = input.path.to;
  print_ = sample.footprint;
  on_path_ = true;
  energised_ = input.active;
  return input;
}

TipTracker::State TipTracker::Save() const {
  State state;
  state.last_s = last_s_;
  state.at = {at_.x(), at_.y()};
  state.x = print_.x;
  state.y = print_.y;
  state.width = print_.width;
  state.height = print_.height();
  std::copy(print_.gap.begin(), print_.gap.end(), state.gap.begin());
  state.on_path = on_path_ ? 1 : 0;
  state.energised = energised_ ? 1 : 0;
  return state;
}

bool TipTracker::Restore(const State& state) {
  Footprint print{state.x, state.y, state.width, {}};
  const bool fits = state.width <= kFootprintCells && state.height <= kFootprintCells;
  if (fits) print.gap.assign(state.gap.begin(), state.gap.begin() + state.width * state.height);
  const bool plausible = std::isfinite(state.last_s) && std::isfinite(state.at[0]) && std::isfinite(state.at[1]) &&
                         fits && print.whole() && print.height() == state.height && state.on_path <= 1 &&
                         state.energised <= 1;
  if (!plausible) return false;
  last_s_ = state.last_s;
  at_ = {state.at[0], state.at[1]};
  print_ = std::move(print);
  on_path_ = state.on_path != 0;
  energised_ = state.energised != 0;
  return true;
}

}  // namespace fulcrum::thermal
