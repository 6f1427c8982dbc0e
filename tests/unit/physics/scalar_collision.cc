#define FULCRUM_KERNEL_SCALAR
#define FULCRUM_KERNEL_NAMESPACE scalar_collision
#include "physics_node/collision/kernels_impl.h"
#include "tests/unit/physics/kernels_scalar.h"

namespace fulcrum::physics::scalar {

const collision::Kernels kCollision = scalar_collision::MakeKernels("scalar");

}  // namespace fulcrum::physics::scalar
