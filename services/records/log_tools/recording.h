// A recording of a cart: the messages of an MCAP file with the metadata of their channels.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "services/base/core/messages.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::log_tools {

/// One writer of one topic.
struct Source {
  std::optional<TopicId> topic;  ///< None: not a topic of this project.
  std::string name;              ///< Name of the topic for people, such as "ToolState".
  std::string node;              ///< Node that wrote it; empty if the file does not contain it.
};

struct Entry {
  recording::McapMessage message;
  const Source* source = nullptr;
  double time_s = 0;  ///< Time since the first message of the file.
};

/// Selection of messages.
struct Filter {
  std::set<std::string> topics;  ///< Topic names for people; empty: all.
  double from_s = -1e300;        ///< Times before 0 exist: a sample is received up to a second after it was sent.
  double to_s = 1e300;
};
/// Throws InputError if a topic of the filter does not exist.
void CheckTopics(const Filter& filter);

class Recording {
 public:
  /// Opens a recording. Throws InputError.
  explicit Recording(const std::filesystem::path& file, Filter filter = {});

  /// Reads the next message that the filter accepts; false at the end.
  bool Next(Entry* entry);
  [[nodiscard]] const recording::McapReader& reader() const { return messages_.reader(); }

 private:
  const Source& SourceOf(std::uint16_t channel);

  recording::TimeOrder messages_;
  Filter filter_;
  std::map<std::uint16_t, Source> sources_;
  std::optional<std::uint64_t> first_ns_;
};

/// The schema with which a recording was written, as far as it has been read, and that of this build, for people: where
/// they differ, messages may not be decoded.
[[nodiscard]] std::string SchemasText(const recording::McapReader& reader);
/// Whether the recording says that it was written with the schema of this build.
[[nodiscard]] bool HasThisSchema(const recording::McapReader& reader);

/// Decodes a message of a known topic and calls `use(message)`. Returns false, without calling `use`, if it cannot be
/// decoded.
template <class Use>
bool WithDecoded(TopicId topic, std::span<const std::uint8_t> bytes, const Use& use) {
  return bus::WithMessageOf(topic, [&]<class T>(std::type_identity<T>) {
    T message;
    if (!bus::DecodeCdr(bytes, &message)) return false;
    use(message);
    return true;
  });
}

}  // namespace fulcrum::log_tools
