// Measures of the closed loop of hand, servo and tissue: stiffness that stays stable, energy, a stall of physics.
#pragma once

#include "haptics_node/device/hand_model.h"

namespace fulcrum::haptics {

struct WallResult {
  bool stable = false;
  double rendered_N_per_mm = 0;  ///< Force over the depth of the device behind the wall's surface.
};
/// A hand hits a wall of this stiffness and rests on it. Stable: in its last half second it moves less than 0.1 mm.
[[nodiscard]] WallResult HitWall(const HandModel& hand, double wall_N_per_mm);

struct CycleEnergy {
  double lost_mJ = 0;    ///< Energy that the hand gave and did not get back, per cycle.
  double stored_mJ = 0;  ///< Largest energy stored in the contact.
};
/// The device is moved 5 mm deep into tissue and out again, twice a second.
[[nodiscard]] CycleEnergy CycleOnTissue();
/// As above, 3 mm deep into a spring of 0.6 N/mm with negligible viscosity.
[[nodiscard]] CycleEnergy CycleOnElasticWall();

struct StallResult {
  double pressed_N = 0;              ///< Before the stall.
  double force_at_400ms_N = 0;       ///< At the hand, 400 ms after the newest model in use.
  double return_step_N_per_5ms = 0;  ///< Largest rise after physics has resumed.
  double returned_N = 0;             ///< A second later.
};
/// Physics stops for a second while the tool presses 8 mm deep.
[[nodiscard]] StallResult StallForASecond();

}  // namespace fulcrum::haptics
