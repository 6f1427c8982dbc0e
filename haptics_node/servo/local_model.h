// The contact models of one device between messages: replays a new model from its own time to now, then cross-fades
// from the old one to the new one, both evaluated at the current tip.
#pragma once

#include <array>
#include <cstdint>

#include "haptics_node/kinematics/trocar.h"
#include "haptics_node/servo/contact_law.h"
#include "haptics_node/servo/pose_ring.h"
#include "haptics_node/servo/stiffness_correction.h"
#include "services/base/core/hash.h"
#include "services/base/core/messages.h"

namespace fulcrum::haptics {

/// Stiffness beyond which a rendered contact would be unstable in a light grip, as felt by the hand [N/m].
inline constexpr double kMaxHandStiffness_N_m = 1200.0;
/// A new model takes over during this time, which is shorter than the period of physics: a model waits for the end of
/// the last fade, so with equal lengths one late model would delay all later ones [ns].
inline constexpr std::int64_t kCrossFade_ns = 8'000'000;

/// Mapping from tip stiffness to hand stiffness: k_hand = scale |J^T n|^2 k_tip.
struct HandMapping {
  double force_scale = 1;
  TrocarPose pose;
};

struct ModelForce {
  Vec3d f_W = Vec3d::Zero();     ///< Force of the tissue on the tool, before force_scale [N].
  Vec3d offset = Vec3d::Zero();  ///< Proxy minus tip: deflection of the virtual coupling [m].
  double stored_J = 0;
  bool touching = false;  ///< The newest model has at least one contact, also one that is only near.
};

class LocalModel {
 public:
  /// False while a cross-fade runs; the caller then keeps the message and retries, because the force would jump if the
  /// cross-fade were cut short.
  [[nodiscard]] bool ready(std::int64_t now_ns) const noexcept { return now_ns - fade_start_ns_ >= kCrossFade_ns; }

  /// Takes over the contacts of a message for time `t_s_ns` and replays them over the ring. First updates the stiffness
  /// correction with the force that the previous message had predicted for that time.
  /// @pre ready(); the contacts have passed the gate.
  void Accept(const DeviceContacts& contacts, std::int64_t t_s_ns, std::int64_t now_ns, const HandMapping& hand,
              const PoseRing& ring) noexcept;

  /// Force now, `dt` after the last call. Once per tick.
  [[nodiscard]] ModelForce Step(const Vec3d& x, std::int64_t now_ns, double dt) noexcept;

  /// Folds the state into a hash.
  void AddTo(Hash64* hash) const noexcept;

 private:
  struct ContactSet {
    std::int64_t t_s_ns = 0;
    std::uint32_t count = 0;
    double force_cap_N = 0;
    std::array<ContactLaw, kMaxContacts> laws;
    std::array<ContactState, kMaxContacts> states;
  };

  struct Prediction {
    std::int64_t stamp_ns = 0;
    Vec3d f_W = Vec3d::Zero();
  };

  void Learn(const DeviceContacts& contacts, std::int64_t t_s_ns) noexcept;
  void AddPrediction(std::int64_t stamp_ns, const Vec3d& f_W) noexcept;
  [[nodiscard]] double CouplingFor(const Contact& contact, std::uint32_t count, const HandMapping& hand) const noexcept;
  [[nodiscard]] static ModelForce StepSet(ContactSet* set, const Vec3d& x, std::int64_t now_ns, double dt) noexcept;

  std::array<ContactSet, 2> sets_;
  std::size_t current_ = 0;
  std::int64_t fade_start_ns_ = -kCrossFade_ns;
  StiffnessCorrection correction_;
  Vec3d reference_f_W_ = Vec3d::Zero();                      ///< Sum of the reference forces of the current set.
  std::array<Prediction, PoseRing::kCapacity> predictions_;  ///< Predicted forces of the current set, by tick.
  std::size_t prediction_count_ = 0;
};

}  // namespace fulcrum::haptics
