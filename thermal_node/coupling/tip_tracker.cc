#include "thermal_node/coupling/tip_tracker.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

bool TipTracker::Accepts(const CauteryContact& sample) const {
  if (!sample.touching) return true;
  const bool numbers = sample.material.allFinite() && std::isfinite(sample.power_W) && sample.power_W >= 0 &&
                       sample.power_W <= kPowerMax_W && std::isfinite(sample.contact_radius_m) &&
                       sample.contact_half.norm() <= kHalfContactMax_m && sample.contact_radius_m >= 0 &&
                       sample.mode <= CauteryMode::kBlend;
  return numbers && sheet_.OnSheet(sample.material);
}

TipInput TipTracker::Advance(const CauteryContact* sample, double dt_s) {
  age_s_ += dt_s;
  if (sample != nullptr) {
    last_ = *sample;
    age_s_ = 0;
  }
  TipInput input;
  if (!last_.touching || age_s_ > kContactTimeout_s) {
    on_path_ = false;
    return input;
  }
  const float reach = kTipSpeedMax_m_s * static_cast<float>(std::max(dt_s, 0.01));
  const bool jumped = !on_path_ || (last_.material - at_).norm() > reach;
  input.path.from = jumped ? last_.material : at_;
  input.path.to = last_.material;
  const float radius = last_.contact_radius_m > 0 ? last_.contact_radius_m : default_radius_m_;
  input.path.radius_m = std::clamp(radius, kContactRadiusMin_m, kContactRadiusMax_m);
  input.path.half = last_.contact_half;
  input.path.tented = last_.tented;
  input.mode = last_.mode;
  input.power_W = last_.power_W;
  input.active = last_.mode != CauteryMode::kOff && last_.power_W > 0;
  at_ = input.path.to;
  on_path_ = true;
  return input;
}

}  // namespace fulcrum::thermal
