#include "haptics_node/servo/model_gate.h"

#include <cmath>

namespace fulcrum::haptics {
namespace {

// The comparisons are written so that NaN fails.
bool Within(float value, float low, float high) noexcept { return value >= low && value <= high; }
bool Shorter(const Vec3f& v, float limit) noexcept { return v.squaredNorm() <= limit * limit; }
bool IsUnit(const Vec3f& v) noexcept {
  return Within(v.norm(), 1.0f - kUnitNormalTolerance, 1.0f + kUnitNormalTolerance);
}

bool AreRenderable(const DeviceContacts& device) noexcept {
  if (device.count > kMaxContacts || !Within(device.p_ext_W, 0.0f, kMaxExternalPower_W) ||
      !Within(device.force_cap_N, 0.0f, 1e3f)) {
    return false;
  }
  for (std::uint32_t i = 0; i < device.count; ++i) {
    if (!IsRenderable(device.contacts[i])) return false;
  }
  return true;
}

}  // namespace

bool IsRenderable(const Contact& c) noexcept {
  const bool kind = c.kind == ContactKind::kSurface || c.kind == ContactKind::kGrasp;
  const bool frame = IsUnit(c.n) && IsUnit(c.e1) && Shorter(c.x_ref, kMaxPlace_m) && Shorter(c.p_s, kMaxPlace_m) &&
                     Shorter(c.v_s, kMaxRate_m_s);
  const bool reference = Shorter(c.f_ref, kMaxReferenceForce_N) && Shorter(c.u_c, kMaxLength_m) &&
                         Shorter(c.du_c, kMaxRate_m_s) && Within(c.gap, -kMaxLength_m, kMaxLength_m);
  const bool skin = Within(c.k1, kMinSkinStiffness_N_m, kMaxSkinStiffness_N_m) &&
                    Within(c.k3, 0.0f, kMaxCubicStiffness) && Within(c.kt, 0.0f, kMaxSkinStiffness_N_m);
  const bool body =
      Within(c.k_body, kMinBodyStiffness_N_m, kMaxBodyStiffness_N_m) && Within(c.b_body, 0.0f, kMaxBodyViscosity_Ns_m);
  const bool rest = Within(c.friction, 0.0f, kMaxFriction) && Within(std::abs(c.kappa1), 0.0f, kMaxCurvature_per_m) &&
                    Within(std::abs(c.kappa2), 0.0f, kMaxCurvature_per_m) && Within(c.slip_force, 0.0f, 1e3f) &&
                    Within(c.radius, 0.0f, kMaxLength_m);
  return kind && frame && reference && skin && body && rest;
}

bool ModelGate::IsInOrder(const ContactModel& model, std::int64_t now_ns) const noexcept {
  // Without a tool stamp physics has not received a tool sample yet; a stamp in the future belongs to another clock.
  if (model.tool_stamp_ns <= 0 || model.tool_stamp_ns > now_ns) return false;
  // A stamp or epoch in the future would make the gate reject all later messages.
  if (model.stamp.stamp_ns > now_ns + kClockSlack_ns || model.stamp.epoch > static_cast<std::uint64_t>(now_ns)) {
    return false;
  }
  if (model.stamp.epoch != epoch_) return model.stamp.epoch > epoch_;
  // Two models may be based on the same tool sample, if physics ran faster than the bus.
  return model.stamp.sequence > sequence_ && model.stamp.stamp_ns > stamp_ns_ && model.tool_stamp_ns >= tool_stamp_ns_;
}

bool ModelGate::Admit(const ContactModel& model, std::int64_t now_ns) noexcept {
  bool good = IsInOrder(model, now_ns);
  for (const DeviceContacts& device : model.devices) good = good && AreRenderable(device);
  if (!good) {
    ++dropped_;
    return false;
  }
  epoch_ = model.stamp.epoch;
  sequence_ = model.stamp.sequence;
  stamp_ns_ = model.stamp.stamp_ns;
  tool_stamp_ns_ = model.tool_stamp_ns;
  return true;
}

}  // namespace fulcrum::haptics
