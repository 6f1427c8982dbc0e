// What a running process may no longer ask the kernel for: a fault in a parser or a driver then ends in an error
// instead of another program, another user's memory or a file of the lab.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::runtime {

/// Where a process may write. What does not exist when Confine() is called is left out.
struct WritablePlaces {
  std::vector<std::filesystem::path> folders;  ///< Below these, files and folders may be made, written and removed.
  std::vector<std::filesystem::path> devices;  ///< These, or the files below, may be opened for writing.
};

/// Version of Landlock's interface that the kernel has; 0: none, or it is switched off.
[[nodiscard]] int LandlockVersion() noexcept;

/// Limits writing to these places, by Landlock, for the calling thread and those that it starts: call before others
/// exist. Files that are open stay open; reading is not limited. Cannot be undone. Returns an empty string, or one line
/// with what is not in force and why.
[[nodiscard]] std::string LimitWriting(const WritablePlaces& places);

/// Refuses, by a seccomp filter of all threads, what no node does after its start (EPERM): other programs (execve),
/// memory of other processes, mounts, namespaces, keys, kernel modules and programs, clocks, other users, io_uring;
/// sockets other than UNIX, IPv4 and netlink, and raw ones. No privilege can be regained (no_new_privs). Cannot be
/// undone. Same return as LimitWriting.
[[nodiscard]] std::string LimitSystemCalls();

}  // namespace fulcrum::runtime
