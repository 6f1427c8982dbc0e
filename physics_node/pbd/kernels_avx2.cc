#define FULCRUM_KERNEL_NAMESPACE avx2
#include "physics_node/pbd/kernels_impl.h"

namespace fulcrum::physics {

const Kernels& Avx2Kernels() {
  static constexpr Kernels kernels{"AVX2",          avx2::GridStretch, avx2::Springs,
                                   avx2::Volumes,   avx2::Bending,     avx2::Bindings,
                                   avx2::Integrate, avx2::Finish,      avx2::ComputeBlockBounds};
  return kernels;
}

}  // namespace fulcrum::physics
