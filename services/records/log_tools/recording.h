// A recording of a cart: the messages of an MCAP file with what its channels tell of them.
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
  std::optional<TopicId> topic;  ///< None: not one of ours.
  std::string name;              ///< Of the topic, for people: "ToolState".
  std::string node;              ///< Who wrote; empty when the file does not tell.
};

struct Entry {
  recording::McapMessage message;
  const Source* source = nullptr;
  double time_s = 0;  ///< Since the first message of the file.
};

/// Which messages are wanted.
struct Filter {
  std::set<std::string> topics;  ///< Names for people; empty: all.
  double from_s = 0;
  double to_s = 1e300;
};
/// Throws InputError when there is no such topic.
void CheckTopics(const Filter& filter);

class Recording {
 public:
  /// Throws InputError.
  explicit Recording(const std::filesystem::path& file, Filter filter = {});

  /// The next message that the filter lets through.
  bool Next(Entry* entry);
  [[nodiscard]] const recording::McapReader& reader() const { return messages_.reader(); }

 private:
  const Source& SourceOf(std::uint16_t channel);

  recording::TimeOrder messages_;
  Filter filter_;
  std::map<std::uint16_t, Source> sources_;
  std::optional<std::uint64_t> first_ns_;
};

/// Decodes a message of a known topic and calls `use(message)`. False when it cannot be decoded; `use` is not called.
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
