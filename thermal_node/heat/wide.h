// FULCRUM_WIDE compiles a kernel for AVX-512, for AVX2 and for the baseline CPU; the loader chooses one. Element-wise
// code without contraction gives the same bits in all of them.
#pragma once

// Only for GCC: clones of clang 14 run AVX-512 on processors that do not have it, and cannot be called from other
// units. Resolvers of cloned functions cannot run while a sanitizer starts. Other processors have the baseline only.
#if !defined(__x86_64__) || defined(__clang__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FULCRUM_WIDE
#else
#define FULCRUM_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
