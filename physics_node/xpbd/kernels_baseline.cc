#define FULCRUM_KERNEL_NAMESPACE xpbd_baseline
#include "physics_node/xpbd/kernels_impl.h"

namespace fulcrum::physics::xpbd {

Kernels BaselineKernels() { return xpbd_baseline::XpbdTable(physics::BaselineKernels()); }

}  // namespace fulcrum::physics::xpbd
