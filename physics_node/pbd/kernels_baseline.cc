#define FULCRUM_KERNEL_NAMESPACE baseline
#include "physics_node/pbd/kernels_impl.h"

namespace fulcrum::physics {

const Kernels& BaselineKernels() {
  static constexpr Kernels kernels{"baseline",          baseline::GridStretch, baseline::Springs,
                                   baseline::Volumes,   baseline::Bending,     baseline::Bindings,
                                   baseline::Integrate, baseline::Finish,      baseline::ComputeBlockBounds};
  return kernels;
}

}  // namespace fulcrum::physics
