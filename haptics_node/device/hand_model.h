// Mechanical model of a hand on the handle: mass, spring and damper between the intended and the actual place of the
// attach point.
#pragma once

#include <algorithm>
#include <cmath>

#include "services/base/core/scene_view.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics {

struct HandModel {
  double mass_kg;
  double stiffness_N_m;
  double damping_Ns_m;

  constexpr HandModel(double mass, double stiffness, double damping)
      : mass_kg(mass), stiffness_N_m(stiffness), damping_Ns_m(damping) {}
  /// The hand that a scene describes.
  constexpr HandModel(const HapticsParams& scene)  // NOLINT(google-explicit-constructor): the same quantities.
      : HandModel(scene.hand_mass_kg, scene.hand_stiffness_N_m, scene.hand_damping_Ns_m) {}
  constexpr HandModel() : HandModel(HapticsParams{}) {}
};

/// Hands from the lightest to the firmest grip. Orders of magnitude from the literature (fingertip: Hajian and Howe
/// 1997), not measured here. For stability they differ mainly in the ratio of damping to stiffness.
inline constexpr HandModel kFingertip{0.015, 200, 2.5};
inline constexpr HandModel kLightGrip{0.10, 400, 6};
inline constexpr HandModel kFirmGrip{0.25, 1500, 20};

/// Moving mass of a desktop device such as the Touch, at the attach point [kg].
inline constexpr double kDeviceMass_kg = 0.045;

/// A hand on a device: mass, spring and damper that follow an intended attach point under the device's force.
class HandOnDevice {
 public:
  explicit HandOnDevice(const HandModel& hand) : hand_(hand) {}

  /// At rest there.
  void Place(const Vec3d& attach_point) {
    position_ = target_ = attach_point;
    velocity_.setZero();
  }
  /// Advances by `elapsed_s`. The intended place moves linearly from the last one to `target`. Implicit Euler on
  /// m a = k (target - x) + b (target' - v) + f: unconditionally stable for any hand.
  void Advance(const Vec3d& target, const Vec3d& force_N, double elapsed_s) {
    const Vec3d target_velocity = (target - target_) / elapsed_s;
    target_ = target;
    const auto [steps, h] = Steps(elapsed_s);
    const double mass = hand_.mass_kg + kDeviceMass_kg;
    const double inertia = mass + h * hand_.damping_Ns_m + h * h * hand_.stiffness_N_m;
    for (int i = 1; i <= steps; ++i) {
      const Vec3d wanted = target - (steps - i) * h * target_velocity;
      velocity_ = (mass * velocity_ +
                   h * (hand_.stiffness_N_m * (wanted - position_) + hand_.damping_Ns_m * target_velocity + force_N)) /
                  inertia;
      position_ += h * velocity_;
    }
  }
  /// Advances by `elapsed_s` without an intended place: only the force moves the device, against the damping.
  void LetGo(const Vec3d& force_N, double elapsed_s) {
    const auto [steps, h] = Steps(elapsed_s);
    const double mass = hand_.mass_kg + kDeviceMass_kg;
    for (int i = 0; i < steps; ++i) {
      velocity_ = (mass * velocity_ + h * force_N) / (mass + h * hand_.damping_Ns_m);
      position_ += h * velocity_;
    }
    target_ = position_;
  }
  [[nodiscard]] const Vec3d& position() const { return position_; }
  [[nodiscard]] const Vec3d& target() const { return target_; }

 private:
  /// After a longer gap the hand has settled anyway; bounds the work of one tick.
  static constexpr double kStep_s = 1e-3, kMaxCatchUp_s = 0.1;
  struct Stepping {
    int count;
    double length_s;
  };
  static Stepping Steps(double elapsed_s) {
    const double span_s = std::min(elapsed_s, kMaxCatchUp_s);
    const int count = std::max(1, static_cast<int>(std::lround(span_s / kStep_s)));
    return {count, span_s / count};
  }

  HandModel hand_;
  Vec3d position_ = Vec3d::Zero(), velocity_ = Vec3d::Zero(), target_ = Vec3d::Zero();
};

}  // namespace fulcrum::haptics
