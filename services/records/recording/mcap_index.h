// Checks whether the summary and the indexes of a closed MCAP file match its content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::recording {

/// Follows footer, summary, each chunk index and each message index to the records to which they refer. Returns the
/// mismatches, for people, at most kMostProblems; `messages`: number of messages to which the indexes refer. Throws
/// InputError if the file cannot be read.
[[nodiscard]] std::vector<std::string> CheckIndex(const std::filesystem::path& file, std::uint64_t* messages);

inline constexpr std::size_t kMostProblems = 20;

}  // namespace fulcrum::recording
