#include "tests/unit/runtime/allocation_guard.h"

#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <cstddef>

#include "services/base/core/sanitizers.h"

namespace {

// constinit: a thread-local that needs no initialisation at run time can be read inside malloc.
constinit thread_local bool watched = false;
constinit thread_local std::int64_t violation_count = 0;

[[maybe_unused]] void Note() noexcept {
  if (watched) ++violation_count;
}

}  // namespace

namespace fulcrum::testing {

AllocationGuard::AllocationGuard() {
  violation_count = 0;
  watched = true;
}
AllocationGuard::~AllocationGuard() { watched = false; }
std::int64_t AllocationGuard::violations() const { return violation_count; }

#if FULCRUM_SANITIZED
bool AllocationGuard::active() { return false; }
#else
bool AllocationGuard::active() { return true; }
#endif

}  // namespace fulcrum::testing

#if !FULCRUM_SANITIZED

// glibc's own entry points stay reachable under these names when the public ones are replaced.
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT(readability-identifier-naming)
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT(readability-identifier-naming)
void* __libc_realloc(void* pointer, std::size_t size);           // NOLINT(readability-identifier-naming)
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT(readability-identifier-naming)
void __libc_free(void* pointer);                                 // NOLINT(readability-identifier-naming)

void* malloc(std::size_t size) noexcept {
  Note();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  Note();
  return __libc_calloc(count, size);
}
void* realloc(void* pointer, std::size_t size) noexcept {
  Note();
  return __libc_realloc(pointer, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  Note();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  Note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) noexcept {
  Note();
  *pointer = __libc_memalign(alignment, size);
  return *pointer == nullptr ? ENOMEM : 0;
}
void free(void* pointer) noexcept {
  if (pointer != nullptr) Note();
  __libc_free(pointer);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  static const Lock next = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  Note();
  return next(mutex);
}
}

#endif
