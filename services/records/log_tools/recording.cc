#include "services/records/log_tools/recording.h"

#include <algorithm>

#include "services/base/core/error.h"
#include "services/transport/bus/hex.h"
#include "services/transport/bus/schema.h"

namespace fulcrum::log_tools {
namespace {

std::string SchemaOf(const recording::McapReader& reader) {
  const auto versions = reader.metadata().find("versions");
  if (versions == reader.metadata().end()) return {};
  const auto hash = versions->second.find("schema_hash");
  return hash == versions->second.end() ? std::string() : hash->second;
}

}  // namespace

std::string SchemasText(const recording::McapReader& reader) {
  const std::string file = SchemaOf(reader);
  return "schema " + (file.empty() ? "unknown" : file) + " of the file, " + bus::Hex(bus::SchemaHash()) + " here";
}

bool HasThisSchema(const recording::McapReader& reader) { return SchemaOf(reader) == bus::Hex(bus::SchemaHash()); }

Recording::Recording(const std::filesystem::path& file, Filter filter) : messages_(file), filter_(std::move(filter)) {}

const Source& Recording::SourceOf(std::uint16_t channel) {
  const auto found = sources_.find(channel);
  if (found != sources_.end()) return found->second;
  const recording::McapChannel& told = reader().channels().at(channel);
  Source source{std::nullopt, told.topic, {}};
  if (const bus::TopicRole* role = bus::RoleNamed(told.topic)) {
    source.topic = role->id;
    source.name = bus::TopicLabel(role->id);
  }
  const auto node = told.metadata.find("node");
  if (node != told.metadata.end()) source.node = node->second;
  return sources_.emplace(channel, std::move(source)).first->second;
}

bool Recording::Next(Entry* entry) {
  while (messages_.Next(&entry->message)) {
    if (!first_ns_) first_ns_ = entry->message.log_time_ns;
    entry->time_s = 1e-9 * static_cast<double>(static_cast<std::int64_t>(entry->message.log_time_ns - *first_ns_));
    entry->source = &SourceOf(entry->message.channel);
    const bool wanted = filter_.topics.empty() || filter_.topics.contains(entry->source->name);
    if (wanted && entry->time_s >= filter_.from_s && entry->time_s <= filter_.to_s) return true;
  }
  return false;
}

void CheckTopics(const Filter& filter) {
  std::set<std::string> known;
  for (const bus::TopicRole& role : bus::kTopicRoles) known.emplace(bus::TopicLabel(role.id));
  for (const std::string& name : filter.topics) {
    if (known.contains(name)) continue;
    std::string message = "no topic \"" + name + "\"; valid:";
    for (const std::string& label : known) message.append(" ").append(label);
    throw InputError(message);
  }
}

}  // namespace fulcrum::log_tools
