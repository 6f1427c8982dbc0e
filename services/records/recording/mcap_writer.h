// Writes an MCAP file: chunks compressed with zstd, checksums, message indexes and a summary.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/records/recording/mcap_chunk.h"

namespace fulcrum::recording {

using TextMap = std::map<std::string, std::string>;

/// What is written stays readable: each schema, channel and complete chunk is passed to the operating system at once,
/// so after a kill the file contains all chunks that were ended before it. Nothing throws once the file is open; the
/// first failure (a full disk, the process's limit on the size of a file) is kept in error(), and no message is added
/// after it. The file then ends with its last complete record; Close() adds the summary if there is room for it.
class McapWriter {
 public:
  /// Creates or replaces `file`, which only its owner may read: a recording is data of a trainee. Throws InputError if
  /// that fails.
  McapWriter(const std::filesystem::path& file, std::string_view profile, std::string_view library);
  /// Closes the file, with its summary.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Adds a schema and returns its number, from 1.
  std::uint16_t AddSchema(std::string_view name, std::string_view encoding, std::string_view text);
  /// Adds a channel and returns its number. With a point coding in its metadata (point_coding.h), its messages become
  /// smaller in the file and are read as before, rounded to its step. @param schema 0: none.
  std::uint16_t AddChannel(std::uint16_t schema, std::string_view topic, std::string_view message_encoding,
                           const TextMap& metadata);
  void AddMetadata(std::string_view name, const TextMap& values);
  /// Adds a message to the open chunk, and ends the chunk when it is ChunkPacker::kChunkBytes long. Times are in
  /// nanoseconds of one clock.
  void Write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
             std::span<const std::byte> data);
  /// Adds a chunk that was packed elsewhere; its channels must be in this file.
  void Append(const PackedChunk& chunk);
  /// Ends the open chunk unless it is empty: all messages so far are then in the file.
  void EndChunk();
  /// Ends the last chunk and adds the summary. Nothing can be written afterwards.
  void Close();

  [[nodiscard]] const std::string& error() const { return error_; }
  /// Number of messages in the chunks that were ended.
  [[nodiscard]] std::uint64_t message_count() const { return message_count_; }
  [[nodiscard]] std::uint64_t bytes_written() const { return offset_; }
  /// Number of bytes that can be added before the limit of the process on the size of a file (RLIMIT_FSIZE), with room
  /// for the summary.
  [[nodiscard]] std::uint64_t BytesToLimit() const;
  [[nodiscard]] bool closed() const { return file_ < 0; }

 private:
  struct ChunkPlace {
    std::uint64_t start;
    std::uint64_t index_B;  ///< Length of the message indexes behind it.
    PackedChunk chunk;      ///< Without its `bytes`.
  };
  struct MetadataPlace {
    std::uint64_t start, length;
    std::string name;
  };

  /// Writes whole records. If that fails, the file is cut to what it was before.
  void Put(std::span<const std::uint8_t> bytes);
  /// Writes the end of the data, the summary and the footer, all or nothing.
  void PutEnd();
  [[nodiscard]] std::vector<std::uint8_t> Statistics() const;

  int file_ = -1;
  std::string error_;
  bool is_torn_ = false;  ///< The file ends within a record, which could not be removed.
  std::uint64_t offset_ = 0, message_count_ = 0;
  std::uint64_t summary_B_ = 0;               ///< Upper limit of the size of the summary so far.
  std::uint64_t first_ns_ = 0, last_ns_ = 0;  ///< Log times over all messages.
  std::vector<std::uint8_t> chunk_;           ///< Messages of the open chunk.
  ChunkPacker packer_;
  PackedChunk packed_;
  std::vector<std::uint8_t> record_;
  std::vector<std::uint8_t> schemas_, channels_;  ///< Their records, which the summary repeats.
  std::uint16_t schema_count_ = 0;
  std::vector<std::uint64_t> counts_;  ///< Number of messages, by channel.
  std::vector<ChunkPlace> chunks_;
  std::vector<MetadataPlace> metadata_;
};

}  // namespace fulcrum::recording
