// What remains of a session whose supervisor was killed is removed at once by a small process that watches it, or, when
// that was killed too, by the next session of the same user.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>

#include "services/session/supervisor/session_folder.h"

namespace fulcrum::supervisor {

/// The watching process: forked from the supervisor, in a session of its own, without any file of the supervisor. When
/// the supervisor dies it kills the children that are left, then removes shared memory and checkpoints. Those it can
/// remove only while no other session has taken the domain; that session then removes them.
class CrashWatch {
 public:
  /// Throws InputError when no process can be made.
  CrashWatch(int domain, std::filesystem::path memory, SessionFolder folder);
  /// Ends the watching process. Removes shared memory and checkpoints itself unless Done() was called: a session that
  /// an exception ended leaves as little as one that was killed.
  ~CrashWatch();
  CrashWatch(const CrashWatch&) = delete;
  CrashWatch& operator=(const CrashWatch&) = delete;

  /// Most children that can be noted.
  static constexpr std::size_t kMostChildren = 32;
  /// Names the process in a place from 0 to kMostChildren - 1, which is killed with its process group; at most 0: none.
  /// Children die with the supervisor anyway (PR_SET_PDEATHSIG), except programs with capabilities and what a child has
  /// started itself.
  void Note(std::size_t place, pid_t child) noexcept;
  /// The session has ended its children and removed everything itself: from now on the watching process ends no
  /// process, since numbers of ended ones may belong to others by then, and only says that the supervisor was killed.
  void Done() noexcept;

  /// The watching process.
  [[nodiscard]] pid_t pid() const { return watcher_; }

 private:
  struct Shared;

  const int domain_;
  const std::filesystem::path memory_;
  const SessionFolder folder_;
  Shared* shared_ = nullptr;
  pid_t watcher_ = -1;
  bool done_ = false;
};

/// Removes what killed sessions of this user have left in shared memory in all domains that no session holds, except
/// `own`.
void SweepKilledSessions(int own);

}  // namespace fulcrum::supervisor
