#include "physics_node/xpbd/kernels.h"

namespace fulcrum::physics::xpbd {

Kernels BestKernels() {
  if (HasAvx512()) {
    return Avx512Kernels();
  }
  return HasAvx2() ? Avx2Kernels() : BaselineKernels();
}

}  // namespace fulcrum::physics::xpbd
