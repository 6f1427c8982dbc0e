#define FULCRUM_KERNEL_NAMESPACE xpbd_avx2
#include "physics_node/xpbd/kernels_impl.h"

namespace fulcrum::physics::xpbd {

Kernels Avx2Kernels() { return xpbd_avx2::XpbdTable(physics::Avx2Kernels()); }

}  // namespace fulcrum::physics::xpbd
