#include "thermal_node/coupling/tip_tracker.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

bool TipTracker::Accepts(const CauteryContact& sample) const {
  if (!std::isfinite(sample.session_time_s)) return false;
  if (!sample.touching) return true;
  const bool numbers = sample.material.allFinite() && std::isfinite(sample.power_W) && sample.power_W >= 0 &&
                       sample.power_W <= kPowerMax_W && std::isfinite(sample.contact_radius_m) &&
                       sample.contact_radius_m >= 0 && sample.mode <= CauteryMode::kBlend &&
                       sample.metal_count <= kMaxMetalPoints;
  return numbers && sheet_.OnSheet(sample.material) &&
         std::all_of(sample.metal.begin(), sample.metal.end(), [](const MetalPoint& point) {
           return point.material.allFinite() && std::isfinite(point.height_m);
         });
}

TipInput TipTracker::Advance(const CauteryContact& sample, double dt_s) {
  TipInput input;
  // The first sample, one after a gap and one from before the last stand for a frame.
  const double since_s = sample.session_time_s - last_s_;
  const bool follows = last_s_ >= 0 && since_s > 0 && since_s <= kLongestGap_s;
  // After a sample without current the time at which the pedal went down is unknown.
  input.duration_s = static_cast<float>(!follows ? dt_s : energised_ ? since_s : std::min(since_s, dt_s));
  on_path_ = on_path_ && follows;
  last_s_ = sample.session_time_s;
  if (!sample.touching) {
    on_path_ = energised_ = false;
    return input;
  }
  const float reach = kTipSpeedMax_m_s * std::max(input.duration_s, 0.01f);
  input.path.to = sample.material;
  input.path.end.count = sample.metal_count;
  input.path.end.points = sample.metal;
  bool jumped = !on_path_ || metal_.count != sample.metal_count;
  if (sample.metal_count == 0) {
    jumped = jumped || (sample.material - at_).norm() > reach;
  } else {
    for (std::uint32_t n = 0; n < sample.metal_count && !jumped; ++n) {
      jumped = (sample.metal[n].material - metal_.points[n].material).norm() > reach;
    }
  }
  input.path.from = jumped ? sample.material : at_;
  input.path.begin = jumped ? input.path.end : metal_;
  const float radius = sample.contact_radius_m > 0 ? sample.contact_radius_m : default_radius_m_;
  input.path.radius_m = std::clamp(radius, kContactRadiusMin_m, kContactRadiusMax_m);
  input.path.tented = sample.tented;
  input.mode = sample.mode;
  input.power_W = sample.mode == CauteryMode::kOff ? 0.0f : sample.power_W;
  input.touching = true;
  input.active = input.power_W > 0;
  at_ = input.path.to;
  metal_ = input.path.end;
  on_path_ = true;
  energised_ = input.active;
  return input;
}

TipTracker::State TipTracker::Save() const {
  State state;
  state.last_s = last_s_;
  state.at = {at_.x(), at_.y()};
  state.metal_count = metal_.count;
  for (std::uint32_t n = 0; n < metal_.count; ++n) {
    const MetalPoint& point = metal_.points[n];
    state.metal[n] = {point.material.x(), point.material.y(), point.height_m};
  }
  state.on_path = on_path_ ? 1 : 0;
  state.energised = energised_ ? 1 : 0;
  return state;
}

bool TipTracker::Restore(const State& state) {
  const auto finite = [](const auto& values) {
    return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
  };
  const bool plausible = std::isfinite(state.last_s) && finite(state.at) && state.metal_count <= kMaxMetalPoints &&
                         std::all_of(state.metal.begin(), state.metal.end(), finite) && state.on_path <= 1 &&
                         state.energised <= 1;
  if (!plausible) return false;
  last_s_ = state.last_s;
  at_ = {state.at[0], state.at[1]};
  metal_.count = state.metal_count;
  for (std::uint32_t n = 0; n < metal_.count; ++n) {
    metal_.points[n] = {{state.metal[n][0], state.metal[n][1]}, state.metal[n][2]};
  }
  on_path_ = state.on_path != 0;
  energised_ = state.energised != 0;
  return true;
}

}  // namespace fulcrum::thermal
