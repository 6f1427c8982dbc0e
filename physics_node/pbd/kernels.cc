#include "physics_node/pbd/kernels.h"

namespace fulcrum::physics {

bool HasAvx2() { return __builtin_cpu_supports("avx2"); }

const Kernels& BestKernels() { return HasAvx2() ? Avx2Kernels() : BaselineKernels(); }

}  // namespace fulcrum::physics
