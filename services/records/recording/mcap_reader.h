// Reads an MCAP file from its beginning, whole or not.
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

namespace fulcrum::recording {

struct McapSchema {
  std::string name, encoding, text;
};
struct McapChannel {
  std::uint16_t schema;  ///< 0: none.
  std::string topic, message_encoding;
  std::map<std::string, std::string> metadata;
};
struct McapMessage {
  std::uint16_t channel;
  std::uint32_t sequence;
  std::uint64_t log_time_ns, publish_time_ns;
  std::span<const std::uint8_t> data;  ///< Until the next call of Next().
};
/// Something in the file that cannot be read.
struct McapFault {
  std::uint64_t offset;  ///< Of the record, in the file.
  std::string what;
};

/// Goes through the records in the order of the file and needs neither summary nor index, so a recording that was cut
/// off by a kill reads up to its last whole chunk. A record that is damaged is left out and told in faults(). Chunks
/// may be plain or packed with zstd. Records that it does not know are passed over, as the format asks.
class McapReader {
 public:
  enum class Depth {
    kMessages,
    kChunkHeads,  ///< Passes chunks over and gives no message: fast, for first_ns, last_ns and metadata.
  };
  /// Throws InputError when the file cannot be read or does not begin as an MCAP file.
  explicit McapReader(const std::filesystem::path& file, Depth depth = Depth::kMessages);

  /// From now on chunks that hold only messages of channels for which this is false are passed over, unread where their
  /// index tells. Such messages in other chunks come nevertheless.
  void PassOver(std::function<bool(const McapChannel&)> wanted) { wanted_ = std::move(wanted); }

  /// The next message, in the order of the file; false at the end of what can be read.
  bool Next(McapMessage* message);

  /// Goes on where it was, with a file handle of its own: for a process that was forked, which shares the old one's
  /// position. Throws InputError when the file is gone.
  void Reopen();

  // What has been met so far.
  [[nodiscard]] const std::string& profile() const { return profile_; }
  [[nodiscard]] const std::string& library() const { return library_; }
  [[nodiscard]] const std::map<std::uint16_t, McapSchema>& schemas() const { return schemas_; }
  [[nodiscard]] const std::map<std::uint16_t, McapChannel>& channels() const { return channels_; }
  [[nodiscard]] const std::map<std::string, std::map<std::string, std::string>>& metadata() const { return metadata_; }
  [[nodiscard]] const std::vector<McapFault>& faults() const { return faults_; }
  /// First and last log time of the chunks met so far; 0: none.
  [[nodiscard]] std::uint64_t first_ns() const { return first_ns_; }
  [[nodiscard]] std::uint64_t last_ns() const { return last_ns_; }
  /// Its writer has closed it: it ends with a footer.
  [[nodiscard]] bool closed() const { return closed_; }

  /// A chunk that says it is longer is taken for damaged.
  static constexpr std::uint64_t kMostChunkBytes = std::uint64_t{1} << 28;
  /// So many faults are kept.
  static constexpr std::size_t kMostFaults = 100;

 private:
  struct Record {
    std::uint8_t opcode;
    std::span<const std::uint8_t> content;
    bool passed_over = false;  ///< Of a chunk only the times were read.
  };
  std::optional<Record> ReadFromFile();
  std::optional<Record> TakeFromChunk();
  /// Looks into the message indexes behind a chunk, which begin there.
  bool HoldsWanted(std::uint64_t indexes);
  /// True when it is a message.
  bool Take(const Record& record, McapMessage* message);
  void OpenChunk(const Record& record);
  void Fault(std::string what);

  std::filesystem::path file_;
  std::function<bool(const McapChannel&)> wanted_;
  const Depth depth_;
  std::ifstream in_;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
  std::uint64_t size_ = 0, next_ = 0, at_ = 0;  ///< Of the file; of the next record; of the one at hand.
  std::vector<std::uint8_t> content_, chunk_;
  std::span<const std::uint8_t> left_;  ///< Of the chunk.
  std::string profile_, library_;
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::map<std::string, std::map<std::string, std::string>> metadata_;
  std::vector<McapFault> faults_;
  bool closed_ = false, done_ = false, chunked_ = false;
};

}  // namespace fulcrum::recording
