// The processes of a session as listed by the kernel.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace fulcrum::soak {

/// Resident memory [bytes], shared memory included; nullopt when there is no such process or it has ended.
[[nodiscard]] std::optional<std::uint64_t> ResidentBytes(pid_t process);

/// The living children of a process by the name of their program; the one of each name that was started first, which is
/// the node where another is its spare. @param processes folder of the kernel's process files.
[[nodiscard]] std::map<std::string, pid_t> ChildrenOf(pid_t parent, const std::filesystem::path& processes = "/proc");

/// Times of this machine's processors since its start, in ticks of the kernel. `stolen` is the time in which the host
/// of a virtual machine ran other guests. All zero where the kernel does not report them.
struct ProcessorTimes {
  std::uint64_t all = 0, stolen = 0;
};
[[nodiscard]] ProcessorTimes ReadProcessorTimes();

}  // namespace fulcrum::soak
