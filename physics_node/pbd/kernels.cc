#include "physics_node/pbd/kernels.h"

namespace fulcrum::physics {

bool HasAvx2() { return __builtin_cpu_supports("avx2"); }

bool HasAvx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl") && HasAvx2();
}

const Kernels& BestKernels() {
  if (HasAvx512()) {
    return Avx512Kernels();
  }
  return HasAvx2() ? Avx2Kernels() : BaselineKernels();
}

}  // namespace fulcrum::physics
