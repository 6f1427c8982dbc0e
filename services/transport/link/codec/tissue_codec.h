// TissueFrame over a slow connection that loses packets. Positions are rounded to whole steps; blocks of neighbouring
// vertices are encoded independently, only those that moved, in chunks that fit one datagram.
//
// Each chunk can be decoded without any other, so a loss affects only the blocks in that chunk. They are sent again
// with their present positions. Without losses the error of a position is at most kTissueError_m.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/core/tissue_blocks.h"
#include "services/transport/link/codec/chunk_book.h"

namespace fulcrum::link {

/// Largest message on the wire [B]: fits an Ethernet frame of 1500 B with the headers of IP, UDP and RTPS, encrypted.
inline constexpr std::size_t kChunk_B = 1280;

/// Distance along any axis between a vertex and its last sent position beyond which the vertex is sent again [steps].
/// Larger than one half, so that noise about the middle between two steps causes no traffic.
inline constexpr double kTissueSlack = 0.75;
/// Largest error of a position without losses, against any position: sqrt(3) * kTissueSlack * kTissueStep_m, and the
/// rounding of a float at 10 m [m]. A frame of the bus has whole steps already, to which this adds nothing.
inline constexpr double kTissueError_m = 7.5e-6;
/// Vertices per block; neighbours in scene order lie close together.
inline constexpr std::uint32_t kTissueBlock = 32;

using SendChunk = std::function<void(std::span<const std::uint8_t>)>;

class TissueSender {
 public:
  /// @param chunks `chunks()` of the sender that this one replaces; 0: none. A receiver ignores older numbers.
  explicit TissueSender(std::uint32_t chunks = 0) : frame_(chunks), sent_(chunks) {}
  /// Number of the last chunk sent; no frame has a larger number, because each has at least one chunk.
  [[nodiscard]] std::uint32_t chunks() const { return sent_.newest(); }
  /// Sends in at least one chunk, with the header, what the receiver needs to reproduce `frame`.
  void Encode(const TissueFrame& frame, const SendChunk& send);
  /// Marks the blocks of a chunk that did not arrive: they are sent again with the next frame or by Flush.
  void Repeat(std::uint32_t chunk);
  void RepeatAll() { dirty_.assign(dirty_.size(), true); }
  /// Sends the newest frame again if some of its blocks are marked and no newer frame has come.
  void Flush(const SendChunk& send);

 private:
  void FindDirty(std::span<const float> xyz);
  void Emit(const SendChunk& send);
  void PutBlock(std::uint32_t block);

  TissueFrameHeader header_;
  std::uint32_t count_ = 0;               ///< Vertices.
  std::vector<std::int32_t> sent_steps_;  ///< Last sent positions, three per vertex [steps].
  std::vector<bool> dirty_;               ///< Per block.
  std::uint32_t next_refresh_ = 0;        ///< Index of a block.
  std::uint32_t frame_;
  SentChunks sent_;
  std::vector<std::uint8_t> chunk_, block_;
};

class TissueReceiver {
 public:
  enum class Result : std::uint8_t {
    kBad,    ///< Malformed chunk: nothing was used.
    kPart,   ///< The frame is not complete yet or has missing blocks.
    kFrame,  ///< frame() is complete and is to be passed on.
  };
  Result Take(std::span<const std::uint8_t> chunk);
  [[nodiscard]] const TissueFrame& frame() const { return frame_; }
  [[nodiscard]] MissingChunks& missing() { return missing_; }
  [[nodiscard]] const MissingChunks& missing() const { return missing_; }
  [[nodiscard]] std::uint64_t bad() const { return bad_; }

 private:
  struct Block;
  [[nodiscard]] bool Decode(std::span<const std::uint8_t> chunk);
  void Apply();

  TissueFrame frame_;
  MissingChunks missing_;
  std::vector<std::uint32_t> newest_;  ///< Per block: the newest frame that contained it; 0: none yet.
  std::uint32_t known_ = 0;            ///< Number of blocks received so far.
  std::uint32_t passed_on_ = 0;        ///< Number of the newest frame for which kFrame was returned.
  std::uint64_t bad_ = 0;
  // State of the chunk that is being decoded.
  std::uint32_t number_ = 0, number_of_frame_ = 0;
  bool last_ = false;
  TissueFrameHeader header_;
  std::vector<std::uint32_t> blocks_;
  std::vector<std::int32_t> values_;  ///< kTissueBlock * 3 per block, axis by axis.
};

}  // namespace fulcrum::link
