// Reads an MCAP file from its beginning, complete or not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "services/base/core/byte_stream.h"
#include "services/records/recording/point_coding.h"

namespace fulcrum::recording {

struct McapSchema {
  std::string name, encoding, text;
  [[nodiscard]] bool operator==(const McapSchema&) const = default;
};
struct McapChannel {
  std::uint16_t schema;  ///< 0: none.
  std::string topic, message_encoding;
  std::map<std::string, std::string> metadata;
  [[nodiscard]] bool operator==(const McapChannel&) const = default;
};
struct McapMessage {
  std::uint16_t channel;
  std::uint32_t sequence;
  std::uint64_t log_time_ns, publish_time_ns;
  std::span<const std::uint8_t> data;  ///< Valid until the next call of Next().
};
/// A part of the file that cannot be read.
struct McapFault {
  std::uint64_t offset;  ///< Position of the record in the file.
  std::string what;
};

/// Reads the records in the order of the file and needs neither summary nor index, so a recording that was interrupted
/// by a kill is readable up to its last complete chunk. A damaged record is skipped and listed in faults(), as is a
/// schema or channel whose number stands for another one already. Chunks may be uncompressed or compressed with zstd.
/// Records of unknown kind are skipped, as the format requires. Coded messages (point_coding.h) are returned as they
/// were before; after one that cannot be decoded, those that refer to it are faults, too.
class McapReader {
 public:
  enum class Depth {
    kMessages,
    kChunkHeads,  ///< Skips the content of chunks and returns no message: fast, for times and metadata.
  };
  /// Throws InputError if the file cannot be read or does not begin as an MCAP file.
  explicit McapReader(const std::filesystem::path& file, Depth depth = Depth::kMessages);

  /// From now on skips chunks that contain only messages of channels for which `wanted` is false, without reading them
  /// if their index shows this. Such messages in other chunks are still returned.
  void PassOver(std::function<bool(const McapChannel&)> wanted) { wanted_ = std::move(wanted); }

  /// Reads the next message, in the order of the file; false at the end of the readable part.
  bool Next(McapMessage* message);

  /// Continues at the same position with a new file handle: for a forked process, which shares the position of the old
  /// one. Throws InputError if the file no longer exists.
  void Reopen();

  // Content of the records read so far.
  [[nodiscard]] const std::string& profile() const { return profile_; }
  [[nodiscard]] const std::string& library() const { return library_; }
  [[nodiscard]] const std::map<std::uint16_t, McapSchema>& schemas() const { return schemas_; }
  [[nodiscard]] const std::map<std::uint16_t, McapChannel>& channels() const { return channels_; }
  [[nodiscard]] const std::map<std::string, std::map<std::string, std::string>>& metadata() const { return metadata_; }
  [[nodiscard]] const std::vector<McapFault>& faults() const { return faults_; }
  /// First and last log time of the chunks read so far; 0: none.
  [[nodiscard]] std::uint64_t first_ns() const { return first_ns_; }
  [[nodiscard]] std::uint64_t last_ns() const { return last_ns_; }
  /// First and last log time of the messages of each channel, by the indexes behind the chunks; with kChunkHeads only.
  struct Span {
    std::uint64_t first_ns, last_ns;
  };
  [[nodiscard]] const std::map<std::uint16_t, Span>& spans() const { return spans_; }
  /// Whether the file ends with a footer, so that its writer has closed it.
  [[nodiscard]] bool closed() const { return closed_; }

  /// A chunk with a larger length counts as damaged. No more is decoded from coded messages of a chunk.
  static constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 28;
  /// Largest number of faults that are kept.
  static constexpr std::size_t kMostFaults = 100;

 private:
  struct Record {
    std::uint8_t opcode;
    std::span<const std::uint8_t> content;
    bool passed_over = false;  ///< Only the times of the chunk were read.
  };
  std::optional<Record> ReadFromFile();
  std::optional<Record> TakeFromChunk();
  /// Whether the message indexes that begin at `indexes`, behind a chunk, contain a wanted channel.
  bool HoldsWanted(std::uint64_t indexes);
  /// Processes a record. True if it is a message.
  bool Take(const Record& record, McapMessage* message);
  void OpenChunk(const Record& record);
  void TakeChannel(std::uint16_t number, const McapChannel& channel);
  void TakeIndex(ByteReader* from);
  /// Decodes the message if it is coded; false if that fails.
  bool Decode(McapMessage* message);
  void Fault(std::string what);

  std::filesystem::path file_;
  std::function<bool(const McapChannel&)> wanted_;
  const Depth depth_;
  std::ifstream in_;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
  std::map<std::uint16_t, Span> spans_;
  /// Size of the file, position of the next record, position of the present one.
  std::uint64_t size_ = 0, next_ = 0, at_ = 0;
  std::vector<std::uint8_t> content_, chunk_;
  std::span<const std::uint8_t> left_;  ///< Unread part of the chunk.
  std::string profile_, library_;
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  PointCoders coders_;
  std::vector<std::uint8_t> decoded_;
  std::uint64_t chunk_decoded_ = 0;  ///< Of the present chunk [B].
  std::map<std::string, std::map<std::string, std::string>> metadata_;
  std::vector<McapFault> faults_;
  bool closed_ = false, done_ = false, chunked_ = false;
};

}  // namespace fulcrum::recording
