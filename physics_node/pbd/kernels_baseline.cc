#define FULCRUM_KERNEL_NAMESPACE baseline
#include "physics_node/pbd/kernels_impl.h"

namespace fulcrum::physics {

const Kernels& BaselineKernels() { return baseline::Table("baseline"); }

}  // namespace fulcrum::physics
