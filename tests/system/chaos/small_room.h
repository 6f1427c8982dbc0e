// A cart that is given a small /dev/shm, or a small or read-only folder for its sessions: in mount and user namespaces
// of its own, so that other processes are not affected.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/support/program.h"

namespace fulcrum::testing {

/// True if the system lets this user create namespaces.
[[nodiscard]] bool CanMakeRoom();

class SmallRoom {
 public:
  /// Runs `fulcrum up SCENE` with a file system of its own at `place`.
  /// @param options of that mount, as "size=20m" or "ro".
  SmallRoom(const std::filesystem::path& place, const std::string& options, const std::string& scene, int domain,
            const std::filesystem::path& out);

  [[nodiscard]] Program& up() { return up_; }
  [[nodiscard]] const std::filesystem::path& out() const { return out_; }
  /// Path as seen by its own processes.
  [[nodiscard]] std::filesystem::path Inside(const std::filesystem::path& path) const;
  /// Fills that file system to its last byte; returns the number of bytes.
  std::uint64_t Fill() const;

 private:
  std::filesystem::path place_, out_;
  Program up_;
};

}  // namespace fulcrum::testing
