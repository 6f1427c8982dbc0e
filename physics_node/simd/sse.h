// The baseline's intrinsics: SSE4.2 itself, or on another processor SIMDe's, which give the same bits there.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#else
#define SIMDE_ENABLE_NATIVE_ALIASES
#include <simde/x86/sse4.2.h>
#endif
