// TissueFrame over a wire that is slow and loses: positions in whole steps, blocks of neighbours told by themselves,
// only those that moved, in chunks that fit one datagram.
//
// Nothing of a chunk needs another one to be understood, so a loss hurts only the blocks that it told of, and these are
// told again as they are by then. Without losses a position is off by kTissueError_m at most.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/link/codec/chunk_book.h"

namespace fulcrum::link {

/// Of one message on the wire: what fits an Ethernet frame of 1500 with the headers of IP, UDP and RTPS, encrypted.
inline constexpr std::size_t kChunk_B = 1280;

/// Positions are told in steps of this [m].
inline constexpr double kTissueStep_m = 5e-6;
/// A vertex is told again when it is further than this from where it was told to be, in steps along any axis. More than
/// a half, so that noise about the middle between two steps costs nothing.
inline constexpr double kTissueSlack = 0.75;
/// sqrt(3) * kTissueSlack * kTissueStep_m, and the rounding of a float at 10 m [m].
inline constexpr double kTissueError_m = 7.5e-6;
inline constexpr std::uint32_t kTissueBlock = 32;  ///< Vertices; neighbours in scene order lie near each other.

using SendChunk = std::function<void(std::span<const std::uint8_t>)>;

class TissueSender {
 public:
  /// Tells what brings the receiver to `frame`: at least one chunk, with the header.
  void Encode(const TissueFrame& frame, const SendChunk& send);
  /// This chunk did not arrive: what it told of is told again with the next frame, or by Flush.
  void Repeat(std::uint32_t chunk);
  void RepeatAll() { dirty_.assign(dirty_.size(), true); }
  /// The newest frame once more, if something of it is to be told again and no newer one has come.
  void Flush(const SendChunk& send);

 private:
  void FindDirty(std::span<const float> xyz);
  void Emit(const SendChunk& send);
  void PutBlock(std::uint32_t block);

  TissueFrameHeader header_;
  std::uint32_t count_ = 0;         ///< Vertices.
  std::vector<std::int32_t> told_;  ///< Three a vertex [steps].
  std::vector<bool> dirty_;         ///< By block.
  std::uint32_t next_refresh_ = 0;  ///< Block.
  std::uint32_t frame_ = 0;
  SentChunks sent_;
  std::vector<std::uint8_t> chunk_, block_;
};

class TissueReceiver {
 public:
  enum class Result : std::uint8_t {
    kBad,    ///< No such chunk: nothing was taken from it.
    kPart,   ///< Not yet a frame, or one with holes.
    kFrame,  ///< frame() is to be passed on.
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
  std::vector<std::uint32_t> newest_;  ///< By block: the frame that told of it last; 0: none yet.
  std::uint32_t known_ = 0;            ///< Blocks told of.
  std::uint32_t passed_on_ = 0;        ///< Newest frame that was kFrame.
  std::uint64_t bad_ = 0;
  // Of the chunk at hand.
  std::uint32_t number_ = 0, number_of_frame_ = 0;
  bool last_ = false;
  TissueFrameHeader header_;
  std::vector<std::uint32_t> blocks_;
  std::vector<std::int32_t> values_;  ///< kTissueBlock * 3 a block, axis by axis.
};

}  // namespace fulcrum::link
