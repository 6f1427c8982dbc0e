#include "physics_node/simd/instruction_set.h"

namespace fulcrum::physics {

#if defined(__x86_64__)

bool Has(InstructionSet set) {
  switch (set) {
    case InstructionSet::kBaseline:
      return true;
    case InstructionSet::kAvx2:
      return __builtin_cpu_supports("avx2");
    case InstructionSet::kAvx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
             __builtin_cpu_supports("avx512vl") && Has(InstructionSet::kAvx2);
  }
  return false;
}

#else

bool Has(InstructionSet set) { return set == InstructionSet::kBaseline; }

#endif

InstructionSet BestInstructionSet() {
  if (Has(InstructionSet::kAvx512)) return InstructionSet::kAvx512;
  return Has(InstructionSet::kAvx2) ? InstructionSet::kAvx2 : InstructionSet::kBaseline;
}

}  // namespace fulcrum::physics
