// The directory of a cart on /dev/shm, where data-sharing keeps the samples of the large topics. The library never
// reclaims the files of a killed process, so whoever restarts processes sweeps here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "services/transport/bus/security.h"

namespace fulcrum::bus {

/// What a cart needs free on /dev/shm: all pools of all large topics, twice, because a restarted node makes new ones
/// before the dead one's are swept. A write to a full /dev/shm is not an error but a SIGBUS.
inline constexpr std::uint64_t kNeededSharedMemory_B = 32u << 20;

/// "/dev/shm/fulcrum-<uid>-<domain>".
[[nodiscard]] std::filesystem::path SharedMemoryDirectory(int domain);

/// Makes the directory, mode 0700. Throws InputError when it cannot be made, belongs to somebody else, is open to
/// others or has less than kNeededSharedMemory_B free.
void PrepareSharedMemory(const std::filesystem::path& directory);

/// The same for whoever begins a session in the domain: without what one that was killed has left there, and with word
/// of how this one is secured. @return the directory.
std::filesystem::path OpenSharedMemory(int domain, const Security& security);

/// Says whose the files named after this address ("xx.xx.….xx", 12 bytes) are: the address of a participant that has
/// authenticated does not tell its process. Goes with the process's other files.
void ClaimSharedMemory(const std::filesystem::path& directory, const std::string& address);

/// Takes the memory of all files that this process has made there. The library leaves them sparse, and who first writes
/// to a page when /dev/shm is full gets a SIGBUS. Throws InputError when there is not enough.
void ReserveSharedMemory(const std::filesystem::path& directory);

/// While it lives, the calling thread works in this directory; other threads do not. For making endpoints: once in a
/// process the library tries out a mapping with a file in the current directory, which may be "/" or not be writable.
class WorkingIn {
 public:
  explicit WorkingIn(const std::filesystem::path& directory);
  ~WorkingIn();
  WorkingIn(const WorkingIn&) = delete;
  WorkingIn& operator=(const WorkingIn&) = delete;

 private:
  int before_;
};

struct SweepResult {
  int files = 0;
  std::uint64_t bytes = 0;
};

/// Removes the files of processes that no longer live. Safe while others run: a live process keeps its files, and a
/// survivor that still maps a removed one keeps its mapping. A missing directory is an empty one.
SweepResult SweepSharedMemory(const std::filesystem::path& directory);

/// Removes the directory with all it holds: at the end of a cart, when no node is left.
SweepResult RemoveSharedMemory(const std::filesystem::path& directory);

}  // namespace fulcrum::bus
