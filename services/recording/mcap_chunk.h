// Messages packed into a chunk, apart from any file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

struct ZSTD_CCtx_s;

namespace fulcrum::recording {

/// A chunk as it stands in a file, its message indexes behind it. Any file that has its channels can take it.
struct PackedChunk {
  std::vector<std::uint8_t> bytes;
  std::uint64_t first_ns = 0, last_ns = 0;  ///< Log times.
  std::uint64_t length = 0;                 ///< Of the chunk without the indexes [B].
  std::uint64_t packed = 0, unpacked = 0;   ///< Of its messages [B].
  bool plain = false;                       ///< Not compressed.
  struct Part {
    std::uint16_t channel;
    std::uint64_t index_offset;  ///< In `bytes`.
    std::uint64_t messages;
  };
  std::vector<Part> parts;
};

/// Collects messages. Allocates nothing once the buffers have grown: fresh megabytes several times a second would cost
/// more than packing them.
class ChunkBuilder {
 public:
  ChunkBuilder();
  ~ChunkBuilder();
  ChunkBuilder(const ChunkBuilder&) = delete;
  ChunkBuilder& operator=(const ChunkBuilder&) = delete;

  void Add(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time_ns, std::uint64_t publish_time_ns,
           std::span<const std::byte> data);
  [[nodiscard]] std::size_t size() const { return messages_.size(); }
  /// Compresses what was added into `chunk`, whose memory is used again, and begins anew.
  void Pack(PackedChunk* chunk);

  /// A chunk of this size is worth ending.
  static constexpr std::size_t kChunkBytes = std::size_t{2} << 20;

 private:
  struct IndexEntry {
    std::uint64_t log_time_ns, offset;
  };
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
  std::vector<std::uint8_t> messages_, packed_;
  std::vector<std::vector<IndexEntry>> index_;  ///< By channel.
  ZSTD_CCtx_s* zstd_;
};

}  // namespace fulcrum::recording
