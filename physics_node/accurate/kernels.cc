#include "physics_node/accurate/kernels.h"

namespace fulcrum::physics::accurate {

const Kernels& BestKernels() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) {
    return Avx512Kernels();
  }
  return __builtin_cpu_supports("avx2") ? Avx2Kernels() : BaselineKernels();
}

}  // namespace fulcrum::physics::accurate
