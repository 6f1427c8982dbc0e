#define FULCRUM_KERNEL_NAMESPACE xpbd_avx512
#include "physics_node/xpbd/kernels_impl.h"

namespace fulcrum::physics::xpbd {

Kernels Avx512Kernels() { return xpbd_avx512::XpbdTable(physics::Avx512Kernels()); }

}  // namespace fulcrum::physics::xpbd
