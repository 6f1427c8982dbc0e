// Tissue for tests and benchmarks of the servo: the viscoelastic half-space z < 0 integrated finely and explicitly, by
// code that is independent of the servo's law; and a model of physics that reports it with the delay of the real one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>

#include "services/base/core/messages.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics::testing {

struct TissueParameters {
  double k1 = 600, k3 = 2e6, kt = 500;
  double k_body = 400, b_body = 8;
  double friction = 0.3;
  bool grasp = false;
};

/// Skin (k1, k3) on a body (Kb, Bb) with Coulomb friction; for a grasp bilateral about the origin.
class TestTissue {
 public:
  explicit TestTissue(const TissueParameters& parameters) : p_(parameters) {}

  /// Moves the tip from its last position to `x` during `dt` and returns the force on the tool.
  Vec3d Step(const Vec3d& x, double dt) {
    constexpr int kSubsteps = 50;
    for (int i = 1; i <= kSubsteps; ++i) {
      const Vec3d at = x_ + (static_cast<double>(i) / kSubsteps) * (x - x_);
      force_ = p_.grasp ? Grasp(at) : Surface(at);
      rate_ = (-force_ - p_.k_body * u_) / p_.b_body;
      u_ += dt / kSubsteps * rate_;
    }
    x_ = x;
    return force_;
  }
  void Place(const Vec3d& x) {
    x_ = x;
    anchor_ = x;
  }

  [[nodiscard]] const Vec3d& force() const { return force_; }
  [[nodiscard]] const TissueParameters& parameters() const { return p_; }

  /// The contact that ideal physics would report now.
  [[nodiscard]] Contact Report() const {
    Contact contact;
    contact.kind = p_.grasp ? ContactKind::kGrasp : ContactKind::kSurface;
    contact.id = 7;
    contact.x_ref = x_.cast<float>();
    contact.f_ref = force_.cast<float>();
    contact.u_c = u_.cast<float>();
    contact.du_c = rate_.cast<float>();
    contact.gap = static_cast<float>(std::max(0.0, x_.z() - u_.z()));
    contact.k1 = static_cast<float>(p_.k1);
    contact.k3 = static_cast<float>(p_.k3);
    contact.kt = static_cast<float>(p_.grasp ? 0.0 : p_.kt);
    contact.k_body = static_cast<float>(p_.k_body);
    contact.b_body = static_cast<float>(p_.b_body);
    contact.friction = static_cast<float>(p_.friction);
    contact.radius = p_.grasp ? 0.0f : 0.2f;
    return contact;
  }

 private:
  [[nodiscard]] Vec3d Surface(const Vec3d& x) {
    const double stretch = std::max(0.0, u_.z() - x.z());
    const double normal = p_.k1 * stretch + p_.k3 * stretch * stretch * stretch;
    const Vec3d u_t(u_.x(), u_.y(), 0);
    Vec3d lag = x - anchor_ - u_t;
    lag.z() = 0;
    Vec3d drag = p_.kt * lag;
    const double limit = p_.friction * normal;
    if (drag.norm() > limit) {
      drag *= limit / drag.norm();
      anchor_ = x - u_t - drag / p_.kt;
    }
    return Vec3d(0, 0, normal) - drag;
  }
  [[nodiscard]] Vec3d Grasp(const Vec3d& x) const {
    const Vec3d lag = x - anchor_ - u_;
    return -(p_.k1 + p_.k3 * lag.squaredNorm()) * lag;
  }

  TissueParameters p_;
  Vec3d x_ = Vec3d(0, 0, 1), anchor_ = Vec3d::Zero();
  Vec3d u_ = Vec3d::Zero(), rate_ = Vec3d::Zero(), force_ = Vec3d::Zero();
};

/// Reports every 10 ms, 10 ms after the tool sample that it used: models are 10 to 20 ms old in use.
class LatePhysics {
 public:
  /// Call once per millisecond with the present tissue. True if `model` has been set to a report that arrives now.
  [[nodiscard]] bool Step(const TestTissue& tissue, std::int64_t now_ns, ContactModel* model) {
    if (!stalled && now_ns >= next_ns_) {
      next_ns_ = now_ns + period_ns;
      ContactModel fresh;
      fresh.tool_stamp_ns = now_ns;
      fresh.devices[0].count = 1;
      fresh.devices[0].contacts[0] = tissue.Report();
      under_way_.push_back(fresh);
    }
    if (under_way_.empty() || now_ns < under_way_.front().tool_stamp_ns + latency_ns) return false;
    *model = under_way_.front();
    under_way_.pop_front();
    if (stalled) return false;
    model->stamp = {++sequence_, epoch, now_ns};
    return true;
  }

  std::int64_t period_ns = 10'000'000;
  std::int64_t latency_ns = 10'000'000;
  bool stalled = false;
  std::uint64_t epoch = 1;

 private:
  std::int64_t next_ns_ = 0;
  std::uint64_t sequence_ = 0;
  std::deque<ContactModel> under_way_;
};

}  // namespace fulcrum::haptics::testing
