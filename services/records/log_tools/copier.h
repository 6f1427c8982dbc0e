// Copies messages of recordings into another recording.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"

namespace fulcrum::log_tools {

/// Large and small topics get chunks of their own, and no chunk spans more than half a second, as in the file of a
/// recorder. Channels of the same writer and topic become one; numbers of schemas and channels may change.
class Copier {
 public:
  explicit Copier(recording::McapWriter* writer) : writer_(writer) {}

  /// Number of the channel in the copy.
  std::uint16_t ChannelOf(const recording::McapReader& reader, std::uint16_t number);
  /// @param shift_ns is added to the log time [ns]. Messages are to be given in order of time, give or take a second.
  void Copy(const recording::McapReader& reader, const recording::McapMessage& message, std::int64_t shift_ns = 0);
  /// Writes the last chunks.
  void Finish();

 private:
  /// Message records of the chunk to come.
  struct Part {
    std::vector<std::uint8_t> records;
    std::uint64_t first_ns = 0;
  };
  void EndChunk(Part* part);
  std::uint16_t AddChannel(const recording::McapReader& reader, const recording::McapChannel& channel);

  recording::McapWriter* writer_;
  recording::ChunkPacker packer_;
  recording::PackedChunk packed_;
  std::array<Part, 2> parts_;  ///< Small topics, large topics.
  std::map<std::pair<const recording::McapReader*, std::uint16_t>, std::uint16_t> channels_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> writers_;  ///< Channel, by topic and writer.
  std::map<std::string, std::uint16_t> schemas_;                          ///< By name and text.
  std::map<std::uint16_t, bool> is_large_;                                ///< By channel of the copy.
};

}  // namespace fulcrum::log_tools
