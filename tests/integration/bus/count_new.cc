#include "tests/integration/bus/count_new.h"

#include <cstdlib>
#include <new>

#include "services/base/core/sanitizers.h"

namespace {
constinit thread_local long new_calls = 0;
}

namespace fulcrum::bus::test {
long NewCalls() { return new_calls; }
}  // namespace fulcrum::bus::test

#if !FULCRUM_SANITIZED
void* operator new(std::size_t size) {
  ++new_calls;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#endif
