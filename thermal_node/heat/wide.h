// Kernels compiled for AVX-512, for AVX2 and for the baseline CPU, chosen when the program is loaded. Element-wise code
// without contraction gives the same bits in all.
#pragma once

// The sanitizers' start-up cannot run the resolvers of cloned functions. Another processor has its baseline only.
#if !defined(__x86_64__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FULCRUM_WIDE
#else
#define FULCRUM_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
