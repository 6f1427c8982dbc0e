// The kernels' source compiled with plain loops as lanes: the reference of the vector kernels.
#pragma once

#include "physics_node/collision/kernels.h"
#include "physics_node/pbd/kernels.h"
#include "physics_node/tissue/kernels.h"

namespace fulcrum::physics::scalar {

extern const tissue::Kernels kMotion;
extern const pbd::Kernels kConstraints;
extern const collision::Kernels kCollision;

}  // namespace fulcrum::physics::scalar
