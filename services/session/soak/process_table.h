// The processes of a session as the kernel sees them.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace fulcrum::soak {

/// Resident memory [bytes], shared memory included; nothing when there is no such process or it has ended.
[[nodiscard]] std::optional<std::uint64_t> ResidentBytes(pid_t process);

/// The living children of a process by the name of their program; the oldest of each name.
[[nodiscard]] std::map<std::string, pid_t> ChildrenOf(pid_t parent);

/// What the processors of this machine have done since it started, in ticks of the kernel. `stolen`: the host of a
/// virtual machine gave them to others meanwhile. Zeros where the kernel does not tell.
struct ProcessorTimes {
  std::uint64_t all = 0, stolen = 0;
};
[[nodiscard]] ProcessorTimes ReadProcessorTimes();

}  // namespace fulcrum::soak
