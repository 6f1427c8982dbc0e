#include "tests/unit/physics/kernels_scalar.h"

#define FULCRUM_KERNEL_SCALAR
#define FULCRUM_KERNEL_NAMESPACE scalar
#include "physics_node/pbd/kernels_impl.h"

namespace fulcrum::physics {

const Kernels& ScalarKernels() { return scalar::Table("scalar"); }

}  // namespace fulcrum::physics
