// The tools of `fulcrum log`. Each writes to `out` for people or programs and throws InputError for errors that the
// user can correct.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "services/base/core/exit_code.h"
#include "services/records/log_tools/recording.h"

namespace fulcrum::log_tools {

/// Content of a file: session, span of time, and messages, rate, size and losses of each topic and node.
void PrintInfo(const std::filesystem::path& file, std::ostream* out);

/// Lists the recordings in a folder and its subfolders, oldest first.
void PrintList(const std::filesystem::path& folder, std::ostream* out);

/// Prints one JSON object per line. Lists longer than `longest` are cut.
void PrintMessages(const std::filesystem::path& file, const Filter& filter, std::size_t longest, std::ostream* out);

/// Writes one table per topic, `folder`/TOPIC.csv. Returns the files. Throws InputError rather than replace one,
/// and when one cannot be written whole. Where messages cannot be decoded, writes the tables of the others and then
/// throws MismatchError for a recording of another schema, InputError for one that is damaged.
std::vector<std::filesystem::path> ExportTables(const std::filesystem::path& file, const Filter& filter,
                                                const std::filesystem::path& folder);

/// Reads the whole file and checks its consistency. kFailure if a fault is found.
ExitCode Verify(const std::filesystem::path& file, std::ostream* out);

/// Prints the first difference of each topic and node. Messages are paired by their writer's sequence; those that
/// cannot be decoded are compared by their bytes. A topic of a node that one file lacks wholly, while it has others of
/// that node, is a difference. @param without a field that is skipped, for example "stamp". kFailure if there is a
/// difference. Throws InputError if the files have no message in common.
ExitCode Diff(const std::filesystem::path& first, const std::filesystem::path& second, const Filter& filter,
              const std::string& without, std::ostream* out);

/// Copies the readable part of `damaged` into a complete file. Returns the faults, for people.
std::vector<std::string> Recover(const std::filesystem::path& damaged, const std::filesystem::path& mended);

}  // namespace fulcrum::log_tools
