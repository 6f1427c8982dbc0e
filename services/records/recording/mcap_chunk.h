// Packing of messages into a chunk, independent of a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "services/records/recording/point_coding.h"

struct ZSTD_CCtx_s;

namespace fulcrum::recording {

/// A chunk in file format, followed by its message indexes. It can be appended to any file that has its channels.
struct PackedChunk {
  std::vector<std::uint8_t> bytes;
  std::uint64_t first_ns = 0, last_ns = 0;  ///< Log times.
  std::uint64_t length = 0;                 ///< Length of the chunk without the indexes [B].
  std::uint64_t packed = 0, unpacked = 0;   ///< Size of its messages, compressed and uncompressed [B].
  bool plain = false;                       ///< Not compressed.
  struct Part {
    std::uint16_t channel;
    std::uint64_t index_offset;  ///< Position in `bytes`.
    std::uint64_t messages;
  };
  std::vector<Part> parts;
};

/// Size of the head of a message record in a chunk [B], which PutMessageHead writes; the data follow.
inline constexpr std::size_t kMessageHead = 31;
void PutMessageHead(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time_ns,
                    std::uint64_t publish_time_ns, std::size_t data_B, std::uint8_t* to);

/// Packs messages into chunks. Allocates nothing once the buffers have grown: allocating megabytes several times a
/// second would cost more than packing them.
class ChunkPacker {
 public:
  ChunkPacker();
  ~ChunkPacker();
  ChunkPacker(const ChunkPacker&) = delete;
  ChunkPacker& operator=(const ChunkPacker&) = delete;

  /// Codes the messages of a channel from now on. The first one of a chunk refers to no other, so each
  /// chunk can be read alone.
  void Code(std::uint16_t channel, const PointCoding& coding);
  /// Packs the first of these message records, as many as fit into `most` bytes but at least one. Returns their length
  /// [B].
  std::size_t Pack(std::span<const std::uint8_t> records, std::size_t most, PackedChunk* chunk);

  /// Size at which a chunk is ended [B].
  static constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
  /// The same for large topics, before their messages are coded. So large that time ends a chunk: its first frame takes
  /// as much as ten others.
  static constexpr std::size_t kLargeChunkBytes = std::size_t{32} << 20;

 private:
  struct IndexEntry {
    std::uint64_t log_time_ns, offset;
  };
  void Compress(std::span<const std::uint8_t> messages, PackedChunk* chunk);

  std::vector<std::uint8_t> packed_;
  std::vector<std::uint8_t> coded_;             ///< The records with coded messages.
  std::vector<std::vector<IndexEntry>> index_;  ///< By channel.
  PointCoders coders_;
  ZSTD_CCtx_s* zstd_;
};

}  // namespace fulcrum::recording
