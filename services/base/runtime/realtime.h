// Real-time set-up, signals and one-line log of a process.
#pragma once

#include <string>
#include <string_view>

namespace fulcrum::runtime {

/// Locks memory (MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) when permitted. Returns an empty string, or one line with what
/// was not permitted, its effect and how to permit it.
[[nodiscard]] std::string LockMemory();

/// Sets SCHED_FIFO on the calling thread. Same return as LockMemory.
[[nodiscard]] std::string SetFifoPriority(int priority);

/// Raises the limit of open files as far as permitted and useful. Returns an empty string, or one line when fewer than
/// `needed` are permitted.
[[nodiscard]] std::string RaiseFileLimit(unsigned needed);

/// The end of a message of an error that a limit of the address space may have caused: a library whose thread or memory
/// was refused may report it by another name. Empty: there is no limit.
[[nodiscard]] std::string AddressSpaceHint();

/// Makes an exception that no thread catches end the process with one line in its log, then abort.
void InstallLastWords();

/// Makes the calling thread flush denormals to zero (they cost up to 20 % in the heat solver).
void FlushDenormals();

/// Makes SIGINT and SIGTERM set the flag that ShouldStop() reads. Ignores SIGPIPE, and SIGXFSZ, so that a write beyond
/// the limit on the size of a file fails instead of ending the process. Call once, first in main.
void InstallStopSignals();
[[nodiscard]] bool ShouldStop() noexcept;
void RequestStop() noexcept;
/// How many of these signals have come, for work after the stop that a further one cancels.
[[nodiscard]] int StopSignals() noexcept;

/// Level of a log line. A line is "12:34:56.789 physics_node info: text" on stderr. Not for the servo thread.
enum class LogLevel { kInfo, kWarning, kError };
void SetLogName(std::string_view name);
void Log(LogLevel level, std::string_view text);

}  // namespace fulcrum::runtime
