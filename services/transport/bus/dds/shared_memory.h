// The directory of a cart on /dev/shm, in which data-sharing keeps the samples of the large topics. The library never
// reclaims the files of a killed process, so the supervisor calls the sweep when it restarts one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "services/transport/bus/security.h"

namespace fulcrum::bus {

/// Free memory that a cart needs on /dev/shm [B]: all pools of all large topics, twice, because a restarted node makes
/// new ones before those of the dead one are swept. A write to a full /dev/shm is not an error but a SIGBUS.
inline constexpr std::uint64_t kNeededSharedMemory_B = 32u << 20;

/// "/dev/shm/fulcrum-<uid>-<domain>".
[[nodiscard]] std::filesystem::path SharedMemoryDirectory(int domain);

/// Makes the directory, mode 0700. Throws InputError if it cannot be made, belongs to another user, is accessible to
/// others or has less than kNeededSharedMemory_B free.
void PrepareSharedMemory(const std::filesystem::path& directory);

/// Prepares the directory for a new session in the domain: removes what a killed session has left there and announces
/// the security of the new one. @return the directory.
std::filesystem::path OpenSharedMemory(int domain, const Security& security);

/// Records that the files named after this address ("xx.xx.….xx", 12 bytes) belong to this process: the address of an
/// authenticated participant does not contain its process id. The record is swept with the other files of the process.
void ClaimSharedMemory(const std::filesystem::path& directory, const std::string& address);

/// Allocates the memory of all files that this process has made there. The library leaves them sparse, and the first
/// write to a page of a full /dev/shm is a SIGBUS. Throws InputError if there is not enough.
void ReserveSharedMemory(const std::filesystem::path& directory);

/// While an object exists, the calling thread has this current directory; other threads do not. For making endpoints:
/// once in a process the library tests a mapping of a file in the current directory, which may be "/" or not writable.
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

/// Removes the files of processes that no longer exist. Safe while other processes run: a live process keeps its files,
/// and a process that still maps a removed file keeps its mapping. A missing directory counts as empty.
SweepResult SweepSharedMemory(const std::filesystem::path& directory);

/// Removes what an ended session has left: the files of dead processes, everything if no live process has a file there,
/// and the directory when it is empty then. Only while the caller holds the domain, because a session that starts would
/// lose its keys.
SweepResult ClearSharedMemory(const std::filesystem::path& directory);

/// Removes the directory with all its content, at the end of a session when no node runs.
SweepResult RemoveSharedMemory(const std::filesystem::path& directory);

}  // namespace fulcrum::bus
