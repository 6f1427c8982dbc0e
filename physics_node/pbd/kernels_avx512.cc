#define FULCRUM_KERNEL_NAMESPACE avx512
#include "physics_node/pbd/kernels_impl.h"

namespace fulcrum::physics {

const Kernels& Avx512Kernels() { return avx512::Table("AVX-512"); }

}  // namespace fulcrum::physics
