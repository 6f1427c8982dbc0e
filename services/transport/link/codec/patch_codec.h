// TemperaturePatch over a wire that is slow and loses: tiles of 16 x 16 texels told by themselves, only those that
// changed, without loss of precision (a texel's four bytes are quantised by their owner).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "services/transport/link/codec/tissue_codec.h"

namespace fulcrum::link {

/// Hot spots that the wire carries at a time; a cart's thermal_node has fewer.
inline constexpr std::uint32_t kMostSlots = 16;

class PatchSender {
 public:
  /// Tells what brings the receiver to `patch`: at least one chunk. A slot beyond kMostSlots is not sent.
  void Encode(const TemperaturePatch& patch, const SendChunk& send);
  /// This chunk did not arrive: what it told of is told again with the next patch of its slot, or by Flush.
  void Repeat(std::uint32_t chunk);
  void RepeatAll();
  /// The newest patch of each slot of which something is to be told again.
  void Flush(const SendChunk& send);

 private:
  struct Slot {
    TemperaturePatchHeader header;
    std::vector<std::uint8_t> told;  ///< Empty: never used.
    std::vector<bool> dirty;         ///< By tile.
    std::uint32_t next_refresh = 0;
  };
  void Emit(Slot* slot, const SendChunk& send);

  std::array<Slot, kMostSlots> slots_;
  std::uint32_t frame_ = 0;
  SentChunks sent_;
  std::vector<std::uint8_t> chunk_, block_;
};

class PatchReceiver {
 public:
  using Result = TissueReceiver::Result;
  /// kFrame: patch() is to be passed on.
  Result Take(std::span<const std::uint8_t> chunk);
  [[nodiscard]] const TemperaturePatch& patch() const { return *newest_patch_; }
  [[nodiscard]] MissingChunks& missing() { return missing_; }
  [[nodiscard]] const MissingChunks& missing() const { return missing_; }
  [[nodiscard]] std::uint64_t bad() const { return bad_; }

 private:
  struct Slot {
    TemperaturePatch patch;
    std::vector<std::uint32_t> newest;  ///< By tile: the frame that told of it last; 0: none yet.
    std::uint32_t known = 0;
    std::uint32_t passed_on = 0;
  };
  [[nodiscard]] bool Decode(std::span<const std::uint8_t> chunk);

  std::array<Slot, kMostSlots> slots_;
  const TemperaturePatch* newest_patch_ = nullptr;
  MissingChunks missing_;
  std::uint64_t bad_ = 0;
  // Of the chunk at hand.
  std::uint32_t number_ = 0, frame_ = 0;
  bool last_ = false;
  TemperaturePatchHeader header_;
  std::vector<std::uint32_t> tiles_;
  std::vector<std::uint8_t> texels_;  ///< kTile_B a tile, row by row.
};

}  // namespace fulcrum::link
