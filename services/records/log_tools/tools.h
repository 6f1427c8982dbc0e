// The tools of `fulcrum log`. Each writes to `out` for people or programs and throws InputError for what the user can
// put right.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "services/base/core/exit_code.h"
#include "services/records/log_tools/recording.h"

namespace fulcrum::log_tools {

/// What a file holds: session, span of time, and messages, rate, size and losses of each topic and node.
void PrintInfo(const std::filesystem::path& file, std::ostream* out);

/// The recordings in a folder and those below, oldest first.
void PrintList(const std::filesystem::path& folder, std::ostream* out);

/// One JSON object a line. Lists longer than `longest` are cut.
void PrintMessages(const std::filesystem::path& file, const Filter& filter, std::size_t longest, std::ostream* out);

/// One table a topic, `folder`/TOPIC.csv. Returns the files. Refuses to replace one.
std::vector<std::filesystem::path> ExportTables(const std::filesystem::path& file, const Filter& filter,
                                                const std::filesystem::path& folder);

/// Reads everything there is to read and compares it with itself. kFailure when anything is wrong.
ExitCode Verify(const std::filesystem::path& file, std::ostream* out);

/// First difference of each topic and node. Messages are paired by their writer's sequence. @param without a field to
/// leave out, for example "stamp". kFailure when there is any.
ExitCode Diff(const std::filesystem::path& first, const std::filesystem::path& second, const Filter& filter,
              const std::string& without, std::ostream* out);

/// Copies what can be read of `damaged` into a whole file. Returns what was wrong, for people.
std::vector<std::string> Recover(const std::filesystem::path& damaged, const std::filesystem::path& mended);

}  // namespace fulcrum::log_tools
