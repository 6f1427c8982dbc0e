#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ostream>

#include "services/base/core/error.h"
#include "services/records/log_tools/sequence_gaps.h"
#include "services/records/log_tools/tools.h"

namespace fulcrum::log_tools {
namespace {

std::string Print(const char* format, auto... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

/// Wall-clock time in UTC.
std::string TimeText(std::uint64_t ns) {
  const auto seconds = static_cast<std::time_t>(ns / 1'000'000'000);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &utc);
  return text.data();
}

std::string Megabytes(std::uint64_t bytes) { return Print("%.1f MB", 1e-6 * static_cast<double>(bytes)); }

std::string Told(const recording::McapReader& reader, const std::string& record, const std::string& key) {
  const auto found = reader.metadata().find(record);
  if (found == reader.metadata().end()) return "";
  const auto value = found->second.find(key);
  return value == found->second.end() ? "" : value->second;
}

/// One topic of one node, with all its writers.
struct Row {
  std::uint64_t messages = 0, bytes = 0, lost = 0;
  std::uint64_t first_ns = 0, last_ns = 0;
};

}  // namespace

void PrintInfo(const std::filesystem::path& file, std::ostream* out) {
  Recording recording(file);
  std::map<std::pair<std::string, std::string>, Row> rows;
  SequenceGaps gaps;
  std::uint64_t first_ns = 0, last_ns = 0, messages = 0, lost = 0;
  Entry entry;
  while (recording.Next(&entry)) {
    const recording::McapMessage& message = entry.message;
    Row& row = rows[{entry.source->name, entry.source->node}];
    if (row.messages++ == 0) row.first_ns = message.log_time_ns;
    row.last_ns = message.log_time_ns;
    row.bytes += message.data.size();
    const std::uint64_t gap = gaps.Before(message);
    row.lost += gap;
    lost += gap;
    first_ns = messages == 0 ? message.log_time_ns : std::min(first_ns, message.log_time_ns);
    last_ns = std::max(last_ns, message.log_time_ns);
    ++messages;
  }
  const recording::McapReader& reader = recording.reader();
  *out << file.string() << " · " << Megabytes(std::filesystem::file_size(file)) << " · "
       << (reader.closed() ? "complete" : "incomplete: its recorder did not close it (fulcrum log recover repairs it)")
       << '\n';
  *out << "session    " << Told(reader, "session", "id") << " · scene \"" << Told(reader, "session", "scene") << "\" "
       << Told(reader, "session", "scene_hash") << '\n';
  *out << "written by " << reader.library() << " · schema " << Told(reader, "versions", "schema_hash") << '\n';
  if (const std::string reason = Told(reader, "dump", "reason"); !reason.empty())
    *out << "dumped     " << reason << '\n';
  if (messages > 0) {
    *out << "began      " << TimeText(first_ns) << " UTC · "
         << Print("%.2f s", 1e-9 * static_cast<double>(last_ns - first_ns)) << " · " << messages << " messages · "
         << lost << " lost\n";
  }
  *out << '\n' << Print("%-18s %-14s %9s %9s %11s %7s\n", "topic", "node", "messages", "Hz", "size", "lost");
  for (const auto& [names, row] : rows) {
    const double span_s = 1e-9 * static_cast<double>(row.last_ns - row.first_ns);
    const double rate_Hz = span_s > 0 ? static_cast<double>(row.messages - 1) / span_s : 0;
    *out << Print("%-18s %-14s %9llu %9.1f %11s %7llu\n", names.first.c_str(), names.second.c_str(),
                  static_cast<unsigned long long>(row.messages), rate_Hz, Megabytes(row.bytes).c_str(),
                  static_cast<unsigned long long>(row.lost));
  }
  for (const auto& [name, values] : reader.metadata()) {
    if (!name.starts_with("lost ")) continue;
    *out << name << ':';
    for (const auto& [what, count] : values) *out << ' ' << what << ' ' << count;
    *out << '\n';
  }
  for (const recording::McapFault& fault : reader.faults()) {
    *out << "! at byte " << fault.offset << ": " << fault.what << '\n';
  }
}

void PrintList(const std::filesystem::path& folder, std::ostream* out) {
  namespace fs = std::filesystem;
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() == ".mcap" && at->is_regular_file(error)) files.push_back(at->path());
  }
  if (error) throw InputError(folder.string() + ": " + error.message());
  std::vector<std::pair<std::uint64_t, std::string>> lines;
  for (const fs::path& file : files) {
    try {
      recording::McapReader reader(file, recording::McapReader::Depth::kChunkHeads);
      recording::McapMessage none;
      while (reader.Next(&none)) {
      }
      const double span_s = 1e-9 * static_cast<double>(reader.last_ns() - reader.first_ns());
      lines.emplace_back(reader.first_ns(),
                         Print("%s  %8.1f s  %10s  %-7s  %-12s  ", TimeText(reader.first_ns()).c_str(), span_s,
                               Megabytes(fs::file_size(file)).c_str(), reader.closed() ? "complete" : "incomplete",
                               Told(reader, "session", "scene").c_str()) +
                             file.string());
    } catch (const InputError& bad) {
      lines.emplace_back(0, std::string("! ") + bad.what());
    }
  }
  std::sort(lines.begin(), lines.end());
  for (const auto& line : lines) *out << line.second << '\n';
  if (lines.empty()) *out << "no recording in " << folder.string() << '\n';
}

}  // namespace fulcrum::log_tools
