#define FULCRUM_KERNEL_SCALAR
#define FULCRUM_KERNEL_NAMESPACE scalar_pbd
#include "physics_node/pbd/kernels_impl.h"
#include "tests/unit/physics/kernels_scalar.h"

namespace fulcrum::physics::scalar {

const pbd::Kernels kConstraints = scalar_pbd::MakeKernels("scalar");

}  // namespace fulcrum::physics::scalar
