// Contact models of tissue whose time passes more slowly than the hand's.
#pragma once

#include "services/base/core/messages.h"

namespace fulcrum::physics {

/// Turns rates per simulated second into rates per second of the servo, which evaluates the contacts in real time:
/// velocities and the power that follows from them become `pace` times as large, the viscosity of the bulk 1 / `pace`
/// times. Below a tenth a pace counts as a tenth, and no viscosity is raised beyond 1000 N s/m. Displacements, forces
/// and stiffnesses do not contain time.
/// @param pace simulated over passed time, > 0 (services/base/core/pace.h); 1 changes nothing.
void ToRealTime(double pace, DeviceContacts* device);

}  // namespace fulcrum::physics
