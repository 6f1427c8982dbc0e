#include <array>
#include <cstdio>
#include <ostream>

#include "services/records/log_tools/text.h"
#include "services/records/log_tools/tools.h"

namespace fulcrum::log_tools {

void PrintMessages(const std::filesystem::path& file, const Filter& filter, std::size_t longest, std::ostream* out) {
  CheckTopics(filter);
  Recording recording(file, filter);
  Entry entry;
  std::string line;
  while (recording.Next(&entry) && *out) {
    std::array<char, 32> time{};
    std::snprintf(time.data(), time.size(), "%.6f", entry.time_s);
    line = std::string("{\"time_s\":") + time.data();
    line += ",\"log_time_ns\":" + std::to_string(entry.message.log_time_ns);
    line += ",\"publish_time_ns\":" + std::to_string(entry.message.publish_time_ns);
    line += ",\"topic\":" + JsonString(entry.source->name) + ",\"node\":" + JsonString(entry.source->node);
    line += ",\"channel\":" + std::to_string(entry.message.channel);
    line += ",\"sequence\":" + std::to_string(entry.message.sequence) + ",\"message\":";
    const bool decoded = entry.source->topic && WithDecoded(*entry.source->topic, entry.message.data,
                                                            [&](const auto& m) { PutJson(m, longest, &line); });
    *out << line << (decoded ? "}\n" : "null}\n");
  }
}

}  // namespace fulcrum::log_tools
