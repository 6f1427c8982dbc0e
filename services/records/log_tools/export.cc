#include <algorithm>
#include <fstream>
#include <limits>
#include <memory>

#include "services/base/core/error.h"
#include "services/records/log_tools/text.h"
#include "services/records/log_tools/tools.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::log_tools {
namespace {

/// A table cell, quoted as in RFC 4180.
std::string Cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted += '"';
}

constexpr std::size_t kWhole = std::numeric_limits<std::size_t>::max();

}  // namespace

std::vector<std::filesystem::path> ExportTables(const std::filesystem::path& file, const Filter& filter,
                                                const std::filesystem::path& folder) {
  CheckTopics(filter);
  Recording recording(file, filter);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::map<TopicId, std::ofstream> tables;
  std::map<std::string, std::uint64_t> undecoded;  // Messages of each topic.
  std::vector<std::filesystem::path> files;
  Entry entry;
  while (recording.Next(&entry)) {
    if (!entry.source->topic) continue;
    std::ofstream& table = tables[*entry.source->topic];
    const bool decoded = WithDecoded(*entry.source->topic, entry.message.data, [&](const auto& message) {
      const bool is_new = !table.is_open();
      if (is_new) {
        const std::filesystem::path name = folder / (entry.source->name + ".csv");
        if (std::filesystem::exists(name)) throw InputError(name.string() + ": exists; choose another folder (--out)");
        table.open(name);
        files.push_back(name);
      }
      std::string head = "time_s,node", row = std::to_string(entry.time_s) + "," + Cell(entry.source->node);
      ForEachLeaf(message, "", kWhole, [&](const std::string& path, const std::string& text) {
        if (is_new) head += "," + path;
        row += "," + Cell(text);
      });
      if (is_new) table << head << '\n';
      table << row << '\n';
    });
    if (!decoded) ++undecoded[entry.source->name];
    if (!table) {
      throw InputError((folder / entry.source->name).string() + ".csv: cannot be written; is the disk full?");
    }
  }
  // The rest of a table reaches the disk only now.
  for (auto& [topic, table] : tables) {
    if (!table.is_open()) continue;
    table.close();
    if (!table) {
      throw InputError((folder / bus::TopicLabel(topic)).string() + ".csv: cannot be written; is the disk full?");
    }
  }
  if (undecoded.empty()) return files;
  std::string what = file.string() + ": cannot be decoded:";
  for (const auto& [topic, count] : undecoded) what += " " + std::to_string(count) + " messages of " + topic + ",";
  what.back() = ';';
  what += " " + SchemasText(recording.reader());
  if (HasThisSchema(recording.reader())) throw InputError(what + "; the file is damaged, see fulcrum log verify");
  throw MismatchError(what + "; use the release that recorded it (fulcrum log info)");
}

}  // namespace fulcrum::log_tools
