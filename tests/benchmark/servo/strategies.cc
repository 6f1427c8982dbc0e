#include "tests/benchmark/servo/strategies.h"

#include <algorithm>
#include <cmath>

#include "haptics_node/servo/contact_law.h"
#include "haptics_node/servo/servo.h"
#include "tests/unit/haptics/rig.h"

namespace fulcrum::haptics {
namespace {

class ServoStrategy final : public ForceStrategy {
 public:
  void Offer(const ContactModel& model, const Tick& tick) override { servo_.OfferModel(model, tick.stamp_ns); }
  Vec3d Step(const Tick& tick, const Vec3d& tip, Vec3d* proxy) override {
    tip_ = tip;
    servo_.Step(tick);
    *proxy = servo_.record().tool.tools[0].p_WT.cast<double>();
    return testing::SentForce(servo_);
  }

 private:
  Vec3d tip_ = Vec3d::Zero();
  testing::GuidedDevice device_{testing::BenchTrocar(), [this](double) { return tip_; }};
  Servo servo_{ServoSettingsOf(testing::BenchScene(1.0)), {&device_, nullptr}};
};

/// Common part of the baselines: the newest report, as doubles.
class Baseline : public ForceStrategy {
 public:
  void Offer(const ContactModel& model, const Tick& /*tick*/) override {
    if (model.devices[0].count == 0) return;
    const Contact& contact = model.devices[0].contacts[0];
    known_ = true;
    grasp_ = contact.kind == ContactKind::kGrasp;
    t_s_ns_ = model.tool_stamp_ns;
    k1_ = contact.k1;
    k3_ = contact.k3;
    kt_ = contact.kt;
    friction_ = contact.friction;
    body_ = contact.k_body;
    x_ref_ = contact.x_ref.cast<double>();
    f_ref_ = contact.f_ref.cast<double>();
    n_ = contact.n.cast<double>();
    du_ = contact.du_c.cast<double>();
    pressure_ = std::max(0.0, n_.dot(f_ref_));
    depth_ = pressure_ > 0.0 ? SkinStretch(k1_, k3_, pressure_) : -static_cast<double>(contact.gap);
    drag_ = f_ref_ - n_.dot(f_ref_) * n_;
    OnReport();
  }
  Vec3d Step(const Tick& tick, const Vec3d& tip, Vec3d* /*proxy*/) final {
    if (!known_) return Vec3d::Zero();
    return Force(tip, 1e-9 * static_cast<double>(tick.stamp_ns - t_s_ns_));
  }

 protected:
  virtual void OnReport() {}
  /// @param age since the tool sample of the report [s].
  [[nodiscard]] virtual Vec3d Force(const Vec3d& tip, double age) = 0;

  /// Skin law on a mesh that stands still: for a surface the normal part, for a grasp the whole force.
  [[nodiscard]] Vec3d FrozenSkin(const Vec3d& tip) const {
    if (grasp_) {
      const double size = f_ref_.norm();
      Vec3d lag = tip - x_ref_;
      if (size > 0.0) lag -= SkinStretch(k1_, k3_, size) / size * f_ref_;
      return -(k1_ + k3_ * lag.squaredNorm()) * lag;
    }
    const double depth = std::max(0.0, depth_ - n_.dot(tip - x_ref_));
    return (k1_ + k3_ * depth * depth) * depth * n_;
  }
  [[nodiscard]] Vec3d Tangent(const Vec3d& v) const { return v - n_.dot(v) * n_; }
  /// A tangential force within the friction cone of `pressure`.
  [[nodiscard]] Vec3d WithinCone(const Vec3d& drag, double pressure) const {
    const double size = drag.norm(), limit = friction_ * pressure;
    return size > limit ? Vec3d(limit / size * drag) : drag;
  }

  bool known_ = false, grasp_ = false;
  std::int64_t t_s_ns_ = 0;
  double k1_ = 0, k3_ = 0, kt_ = 0, friction_ = 0, body_ = 0, pressure_ = 0, depth_ = 0;
  Vec3d x_ref_ = Vec3d::Zero(), f_ref_ = Vec3d::Zero(), n_ = Vec3d::UnitZ(), du_ = Vec3d::Zero(), drag_ = Vec3d::Zero();
};

class HeldForce final : public Baseline {
  Vec3d Force(const Vec3d& /*tip*/, double /*age*/) override { return grasp_ ? f_ref_ : Vec3d(pressure_ * n_); }
};

/// The mesh of the last report stands still; depth x normal against it each millisecond.
class HeldMesh final : public Baseline {
  Vec3d Force(const Vec3d& tip, double /*age*/) override { return FrozenSkin(tip); }
};

/// As above, with a proxy that sticks to the mesh and slides in the friction cone; the mesh may be extrapolated at its
/// last velocity.
class GodObject final : public Baseline {
 public:
  explicit GodObject(bool extrapolates) : extrapolates_(extrapolates) {}

 private:
  void OnReport() override {
    anchor_ = x_ref_;
    if (kt_ > 0.0) anchor_ += drag_ / kt_;
  }
  Vec3d Force(const Vec3d& tip, double age) override {
    const Vec3d seen = extrapolates_ ? Vec3d(tip - age * du_) : tip;
    Vec3d skin = FrozenSkin(seen);
    if (grasp_ || kt_ <= 0.0) return skin;
    const Vec3d stick = -kt_ * Tangent(seen - anchor_);
    const Vec3d drag = WithinCone(stick, skin.norm());
    anchor_ = seen + drag / kt_;
    return skin + drag;
  }

  bool extrapolates_;
  Vec3d anchor_ = Vec3d::Zero();
};

/// f_ref - K (x - x_ref) with the stiffness of skin and body in series.
class LinearModel final : public Baseline {
  Vec3d Force(const Vec3d& tip, double /*age*/) override {
    const double stretch = SkinStretch(k1_, k3_, f_ref_.norm());
    const double skin = k1_ + 3 * k3_ * stretch * stretch;
    const double normal = 1 / (1 / skin + 1 / body_);
    const Vec3d moved = tip - x_ref_;
    if (grasp_) return f_ref_ - normal * moved;
    // Before contact the line begins at the end of the gap.
    const double pressure = std::max(0.0, pressure_ - normal * (n_.dot(moved) - std::min(0.0, depth_)));
    const double along = kt_ > 0.0 ? 1 / (1 / kt_ + 1 / body_) : 0.0;
    return pressure * n_ + WithinCone(drag_ - along * Tangent(moved), pressure);
  }
};

}  // namespace

std::unique_ptr<ForceStrategy> MakeServo() { return std::make_unique<ServoStrategy>(); }
std::unique_ptr<ForceStrategy> MakeHeldForce() { return std::make_unique<HeldForce>(); }

std::vector<NamedStrategy> Strategies() {
  return {{"depth x normal, held", "#8a6d1a", MakeHeldForce},
          {"ZOH mesh", "#c8501e", [] { return std::make_unique<HeldMesh>(); }},
          {"god-object", "#b3245b", [] { return std::make_unique<GodObject>(false); }},
          {"extrapolated mesh", "#7b4fa3", [] { return std::make_unique<GodObject>(true); }},
          {"linear local model", "#2e8540", [] { return std::make_unique<LinearModel>(); }},
          {"Zener model + replay (this servo)", "#1b6ca8", MakeServo}};
}

}  // namespace fulcrum::haptics
