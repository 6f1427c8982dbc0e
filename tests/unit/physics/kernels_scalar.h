// The kernels' source compiled with lanes that are plain loops: the oracle of the vector kernels.
#pragma once

#include "physics_node/pbd/kernels.h"

namespace fulcrum::physics {

const Kernels& ScalarKernels();

}  // namespace fulcrum::physics
