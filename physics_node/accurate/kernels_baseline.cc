#define FULCRUM_KERNEL_NAMESPACE accurate_baseline
#include "physics_node/accurate/kernels_impl.h"

namespace fulcrum::physics::accurate {

const Kernels& BaselineKernels() {
  static constexpr Kernels kernels = accurate_baseline::MakeKernels("baseline");
  return kernels;
}

}  // namespace fulcrum::physics::accurate
