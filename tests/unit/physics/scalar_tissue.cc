#define FULCRUM_KERNEL_SCALAR
#define FULCRUM_KERNEL_NAMESPACE scalar_tissue
#include "physics_node/tissue/kernels_impl.h"
#include "tests/unit/physics/kernels_scalar.h"

namespace fulcrum::physics::scalar {

const tissue::Kernels kMotion = scalar_tissue::MakeKernels("scalar");

}  // namespace fulcrum::physics::scalar
