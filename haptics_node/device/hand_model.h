// Mechanical model of a hand on the handle: mass, spring and damper between the intended and the actual place of the
// attach point.
#pragma once

#include "services/base/core/scene_view.h"

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

}  // namespace fulcrum::haptics
