#define FULCRUM_KERNEL_NAMESPACE accurate_avx512
#include "physics_node/accurate/kernels_impl.h"

namespace fulcrum::physics::accurate {

const Kernels& Avx512Kernels() {
  static constexpr Kernels kernels = accurate_avx512::MakeKernels("AVX-512");
  return kernels;
}

}  // namespace fulcrum::physics::accurate
