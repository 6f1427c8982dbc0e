#define FULCRUM_KERNEL_NAMESPACE accurate_avx2
#include "physics_node/accurate/kernels_impl.h"

namespace fulcrum::physics::accurate {

const Kernels& Avx2Kernels() {
  static constexpr Kernels kernels = accurate_avx2::MakeKernels("AVX2");
  return kernels;
}

}  // namespace fulcrum::physics::accurate
