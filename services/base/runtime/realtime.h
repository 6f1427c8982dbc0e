// Real-time set-up, signals and one-line log of a process.
#pragma once

#include <string>
#include <string_view>

namespace fulcrum::runtime {

/// Locks memory (MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) when permitted. Returns an empty string, or one plain line
/// that says what was not permitted, what that means and how to permit it.
[[nodiscard]] std::string LockMemory();

/// Sets SCHED_FIFO on the calling thread. Same return as LockMemory.
[[nodiscard]] std::string SetFifoPriority(int priority);

/// Flush denormals to zero on the calling thread (they cost up to 20 % in the heat solver).
void FlushDenormals();

/// SIGINT and SIGTERM set the flag that ShouldStop() reads; SIGPIPE is ignored. Call once, first thing in main.
void InstallStopSignals();
[[nodiscard]] bool ShouldStop() noexcept;
void RequestStop() noexcept;

/// "12:34:56.789 physics_node info: text" on stderr. Not for the servo thread.
enum class LogLevel { kInfo, kWarning, kError };
void SetLogName(std::string_view name);
void Log(LogLevel level, std::string_view text);

}  // namespace fulcrum::runtime
