// Whether the summary and the indexes of a closed MCAP file fit what the file holds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::recording {

/// Follows footer, summary, each chunk index and each message index to what it points at. Returns what does not fit,
/// for people, at most kMostProblems; `messages`: how many the indexes lead to. Throws InputError when the file cannot
/// be read.
[[nodiscard]] std::vector<std::string> CheckIndex(const std::filesystem::path& file, std::uint64_t* messages);

inline constexpr std::size_t kMostProblems = 20;

}  // namespace fulcrum::recording
