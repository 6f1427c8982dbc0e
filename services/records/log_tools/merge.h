// Joins the recordings of one session: those of a recorder that was restarted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::log_tools {

struct MergeResult {
  std::uint64_t messages = 0;
  std::vector<std::string> notes;  ///< Faults of the files, and the times of which no file has anything; for people.
};

/// Writes all messages of `files` into `out`, each once and in order of time. A file that was not closed is read up to
/// its last complete chunk. Throws InputError if the files are not of the same session and scene, or `out` exists or
/// cannot be written.
[[nodiscard]] MergeResult Merge(const std::vector<std::filesystem::path>& files, const std::filesystem::path& out);

struct JoinResult {
  std::string said;   ///< What was done, or why nothing was, for people; empty: there is only one file.
  bool whole = true;  ///< The session is in one file.
};

/// Joins `recording` with the files that restarted recorders have written beside it (recording-2.mcap …) into one with
/// its name, and removes these.
/// @param keep_free_B space that stays free on the disk [B].
[[nodiscard]] JoinResult JoinSegments(const std::filesystem::path& recording, std::uint64_t keep_free_B);

}  // namespace fulcrum::log_tools
