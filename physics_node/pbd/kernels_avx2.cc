#define FULCRUM_KERNEL_NAMESPACE avx2
#include "physics_node/pbd/kernels_impl.h"

namespace fulcrum::physics {

const Kernels& Avx2Kernels() { return avx2::Table("AVX2"); }

}  // namespace fulcrum::physics
