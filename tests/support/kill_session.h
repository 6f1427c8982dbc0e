// A cart whose nodes, recorder and supervisor are killed one after another, and what remains of its sessions.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace fulcrum::testing {

/// Sums over sessions.
struct KillFindings {
  std::map<std::string, int> kills;       ///< By program.
  std::uint64_t topology_lost = 0;        ///< Revisions and dead edges that a later TopologyState did not have.
  std::uint64_t topology_unrecorded = 0;  ///< Revisions older than the last kill but one that no recording contains.
  int recordings = 0;
  int cut_short = 0;   ///< Recordings without a footer: their recorder was killed.
  int damaged = 0;     ///< Recordings that `fulcrum log recover` does not make valid.
  std::string damage;  ///< Output of the tools for these.
  std::uint64_t shared_memory_left_B = 0;
  int processes_left = 0;
  double unrecorded_s_max = 0;  ///< Longest time from the last recorded ToolState to the supervisor's kill.
  std::string wrong;            ///< Why the sessions could not continue; empty: they could.

  [[nodiscard]] int all() const;
};

/// Size of the files of an ended session that are left in shared memory, at least 1 for each: in the cart's directory,
/// and what the library would put beside it.
[[nodiscard]] std::uint64_t SharedMemoryLeft(int domain);

/// How a session ends.
enum class LastKill { kSupervisor, kNone };

/// One session of a scene that cuts all the time. The five nodes and the recorder are killed in turn, so far apart that
/// each counts as healthy again. With kSupervisor the last of `kills` is that of the supervisor; otherwise SIGINT ends
/// the session afterwards.
/// @param turn index of the first victim, so that sessions differ.
void RunKillSession(const std::filesystem::path& scene, int domain, int kills, int turn, LastKill last,
                    KillFindings* findings);

}  // namespace fulcrum::testing
