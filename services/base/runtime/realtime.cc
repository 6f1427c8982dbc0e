#include "services/base/runtime/realtime.h"

#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

namespace fulcrum::runtime {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<int> stop_signals{0};
static_assert(std::atomic<bool>::is_always_lock_free, "the signal handler may only touch a lock-free flag");

// Fixed storage, since a log line may come from any thread while main sets the name.
std::array<char, 32> log_name{"fulcrum"};

void OnStopSignal(int) {
  stop_requested.store(true, std::memory_order_relaxed);
  stop_signals.fetch_add(1, std::memory_order_relaxed);
}

bool HasCapability(int capability) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, 2> data{};
  if (syscall(SYS_capget, &header, data.data()) != 0) return false;
  return (data[static_cast<std::size_t>(capability / 32)].effective >> (capability % 32)) & 1u;
}

}  // namespace

std::string LockMemory() {
  std::string how =
      "memory is not locked, so a page fault may delay a cycle; to permit it, raise \"memlock\" to unlimited for this "
      "user in /etc/security/limits.conf, or give the program CAP_IPC_LOCK";
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  // Under a finite limit mlockall may succeed now and make every later allocation beyond the limit fail.
  if (limit.rlim_cur != RLIM_INFINITY && !HasCapability(CAP_IPC_LOCK)) return how;
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) return how + " (" + std::strerror(errno) + ")";
  return {};
}

std::string SetFifoPriority(int priority) {
  sched_param param{};
  param.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
  if (error == 0) return {};
  return "real-time priority " + std::to_string(priority) + " is not permitted (" + std::strerror(error) +
         "), so cycles may start late under load; to permit it, set \"rtprio\" to 90 for this user in "
         "/etc/security/limits.conf, or give the program CAP_SYS_NICE";
}

std::string RaiseFileLimit(unsigned needed) {
  constexpr rlim_t kUseful = 4096;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return {};
  const rlim_t wanted = std::min<rlim_t>(limit.rlim_max, kUseful);
  if (limit.rlim_cur < wanted) {
    limit.rlim_cur = wanted;
    setrlimit(RLIMIT_NOFILE, &limit);
  }
  if (limit.rlim_cur >= needed) return {};
  return "open files: a process of this user may have " + std::to_string(limit.rlim_cur) + ", at least " +
         std::to_string(needed) +
         " are needed; raise the limit: \"nofile\" in /etc/security/limits.conf, LimitNOFILE= of a service, or "
         "ulimit -Hn of the shell that lowered it";
}

std::string AddressSpaceHint() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  return "; its address space is limited to " + std::to_string(limit.rlim_cur >> 20) + " MiB (ulimit -v)";
}

void InstallLastWords() {
  std::set_terminate([] {
    try {
      if (const std::exception_ptr exception = std::current_exception()) std::rethrow_exception(exception);
      Log(LogLevel::kError, "terminated");
    } catch (const std::bad_alloc&) {
      constexpr std::string_view kText = "error: out of memory\n";  // A log line would need some.
      if (write(STDERR_FILENO, kText.data(), kText.size()) < 0) std::abort();
    } catch (const std::exception& error) {
      Log(LogLevel::kError, std::string("uncaught: ") + error.what() + AddressSpaceHint());
    } catch (...) {
      Log(LogLevel::kError, "uncaught exception of an unknown kind");
    }
    std::abort();
  });
}

void FlushDenormals() {
#if defined(__x86_64__)
  // MXCSR: results, and operands.
  constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
  __builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | kFlushToZero | kDenormalsAreZero);
#elif defined(__aarch64__)
  // FPCR.FZ: results and operands.
  constexpr std::uint64_t kFlushToZero = std::uint64_t{1} << 24;
  std::uint64_t control = 0;
  asm volatile("mrs %0, fpcr" : "=r"(control));
  asm volatile("msr fpcr, %0" : : "r"(control | kFlushToZero));
#endif
}

void InstallStopSignals() {
  struct sigaction stop {};
  stop.sa_handler = OnStopSignal;
  sigemptyset(&stop.sa_mask);
  sigaction(SIGINT, &stop, nullptr);
  sigaction(SIGTERM, &stop, nullptr);
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigemptyset(&ignore.sa_mask);
  sigaction(SIGPIPE, &ignore, nullptr);
  sigaction(SIGXFSZ, &ignore, nullptr);
}

bool ShouldStop() noexcept { return stop_requested.load(std::memory_order_relaxed); }

int StopSignals() noexcept { return stop_signals.load(std::memory_order_relaxed); }

void RequestStop() noexcept { stop_requested.store(true, std::memory_order_relaxed); }

void SetLogName(std::string_view name) {
  const std::size_t length = std::min(name.size(), log_name.size() - 1);
  std::memcpy(log_name.data(), name.data(), length);
  log_name[length] = '\0';
}

void Log(LogLevel level, std::string_view text) {
  constexpr std::array<const char*, 3> kLevels{"info", "warning", "error"};
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  tm local{};
  localtime_r(&now.tv_sec, &local);
  std::array<char, 96> head{};
  std::snprintf(head.data(), head.size(), "%02d:%02d:%02d.%03ld %s %s: ", local.tm_hour, local.tm_min, local.tm_sec,
                now.tv_nsec / 1'000'000, log_name.data(), kLevels[static_cast<std::size_t>(level)]);
  std::string line(head.data());
  line.append(text);
  line.push_back('\n');
  // One write, so that lines of several processes on one terminal or file do not mix.
  if (write(STDERR_FILENO, line.data(), line.size()) < 0) return;
}

}  // namespace fulcrum::runtime
