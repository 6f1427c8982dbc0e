// The local model of one contact: a skin law in series with a viscoelastic body, with Coulomb friction along the
// surface, or held on all sides by a grasp. The servo evaluates it every millisecond between two messages of physics.
//
//     tool x ──[coupling C]──┐
//                            ├──[skin k1, k3]──┬──[body spring Kb]──┐
//                            │    stretch δ    └──[body damper Bb]──┴── undisturbed surface, moving with v_s
//                            │                     displacement q
// All in frame W, SI, forces in newtons of tissue on tool.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics {

/// Parameters of one contact, fixed for the life of one message.
struct ContactLaw {
  ContactKind kind = ContactKind::kNone;
  std::uint32_t id = 0;
  Vec3d x_ref = Vec3d::Zero();
  Vec3d n = Vec3d::UnitZ(), e1 = Vec3d::UnitX(), e2 = Vec3d::UnitY();
  Vec3d p_s = Vec3d::Zero(), v_s = Vec3d::Zero();
  double depth_offset = 0;  ///< Added to the geometric depth, so that the law gives f_ref at x_ref [m].
  double k1 = 0, k3 = 0, kt = 0, k_body = 0, b_body = 0, friction = 0;
  double kappa1 = 0, kappa2 = 0;
  double slip_force = 0;
  double radius = 0;
  double coupling = 0;         ///< C: compliance of the virtual coupling, on the device side [m/N].
  double q0 = 0;               ///< Rest displacement of the body spring, inwards [m].
  Vec3d q0_t = Vec3d::Zero();  ///< The same along the surface; of a grasp in all directions [m].
};

/// State of a contact, advanced in each tick.
struct ContactState {
  double q = 0;               ///< Displacement of the body, inwards [m].
  Vec3d q_t = Vec3d::Zero();  ///< The same along the surface; of a grasp in all directions [m].
  /// Anchor of the friction spring on the surface, without the surface's motion v_s t [m].
  Vec3d anchor = Vec3d::Zero();
};

struct ContactForce {
  Vec3d f_W = Vec3d::Zero();  ///< Force of the tissue on the tool [N].
  double stored_J = 0;        ///< Elastic energy that the contact can return to the tool.
};

/// Law and initial state, at the message's own time t_s, of a contact that has passed the gate. The initial state is
/// the one that physics computed: displacement u_c at rate du_c under the force f_ref at the tip position x_ref.
[[nodiscard]] ContactLaw MakeContactLaw(const Contact& contact, double coupling, ContactState* state) noexcept;

/// Advances the state by dt with the tip at `x`, `t` after the message's time, and returns the force. Implicit in the
/// body and in the force, so stable for any stiffness; the cost is bounded by a few Newton iterations in one unknown.
[[nodiscard]] ContactForce StepContact(const ContactLaw& law, const Vec3d& x, double t, double dt,
                                       ContactState* state) noexcept;

/// Stretch δ >= 0 with δ + compliance (k1 δ + k3 δ^3) = depth, for depth >= 0 [m]. @pre k1, k3, compliance >= 0.
[[nodiscard]] double SolveSkin(double k1, double k3, double compliance, double depth) noexcept;

/// Stretch δ with k1 δ + k3 δ^3 = force, for force >= 0 [m]. @pre k1 > 0, k3 >= 0.
[[nodiscard]] double SkinStretch(double k1, double k3, double force) noexcept;

}  // namespace fulcrum::haptics
