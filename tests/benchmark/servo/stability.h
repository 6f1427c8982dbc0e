// Measures of the closed loop of hand, servo and tissue: stiffness that stays stable, energy, a stall of physics.
#pragma once

#include "haptics_node/device/hand_model.h"

namespace fulcrum::haptics {

struct WallResult {
  bool stable = false;
  double rendered_N_per_mm = 0;  ///< Force over how far the device is behind the wall's surface.
};
/// A hand hits a wall of this stiffness and rests on it. Stable: in its last half second it moves less than 0.1 mm.
[[nodiscard]] WallResult HitWall(const HandModel& hand, double wall_N_per_mm);

struct CycleEnergy {
  double lost_mJ = 0;    ///< That the hand gave and did not get back, per cycle.
  double stored_mJ = 0;  ///< Most that the contact stored.
};
/// The device is led into tissue and out again, 5 mm deep, twice a second.
[[nodiscard]] CycleEnergy CycleOnTissue();
/// The same 3 mm deep into a spring of 0.6 N/mm without viscosity to speak of.
[[nodiscard]] CycleEnergy CycleOnElasticWall();

struct StallResult {
  double pressed_N = 0;              ///< Before.
  double force_at_400ms_N = 0;       ///< After the newest model in use, at the hand.
  double return_step_N_per_5ms = 0;  ///< Largest rise after physics is back.
  double returned_N = 0;             ///< A second after.
};
/// Physics stops for a second while the tool presses 8 mm deep.
[[nodiscard]] StallResult StallForASecond();

}  // namespace fulcrum::haptics
