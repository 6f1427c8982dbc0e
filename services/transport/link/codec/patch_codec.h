// TemperaturePatch over a slow connection that loses packets. Tiles of 16 × 16 texels are encoded independently, only
// those that changed, without loss of precision (the owner has already quantised a texel to four bytes).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "services/transport/link/codec/tissue_codec.h"

namespace fulcrum::link {

/// Patch slots (hot spots) that the link carries at a time; a cart's thermal_node has fewer.
inline constexpr std::uint32_t kMostSlots = 16;

class PatchSender {
 public:
  /// @param chunks `chunks()` of the sender that this one replaces; 0: none. A receiver ignores older numbers.
  explicit PatchSender(std::uint32_t chunks = 0) : frame_(chunks), sent_(chunks) {}
  /// Number of the last chunk sent; no frame has a larger number, because each has at least one chunk.
  [[nodiscard]] std::uint32_t chunks() const { return sent_.newest(); }
  /// Sends in at least one chunk what the receiver needs to reproduce `patch`. A slot beyond kMostSlots is not sent.
  void Encode(const TemperaturePatch& patch, const SendChunk& send);
  /// Marks the tiles of a chunk that did not arrive: they are sent again with the next patch of their slot or by Flush.
  void Repeat(std::uint32_t chunk);
  void RepeatAll();
  /// Sends the newest patch of each slot that has tiles to send again.
  void Flush(const SendChunk& send);

 private:
  struct Slot {
    TemperaturePatchHeader header;
    std::vector<std::uint8_t> told;  ///< Texels as sent; empty: slot never used.
    std::vector<bool> dirty;         ///< Per tile.
    std::uint32_t next_refresh = 0;
  };
  void Emit(Slot* slot, const SendChunk& send);

  std::array<Slot, kMostSlots> slots_;
  std::uint32_t frame_;
  SentChunks sent_;
  std::vector<std::uint8_t> chunk_, block_;
};

class PatchReceiver {
 public:
  using Result = TissueReceiver::Result;
  /// Decodes a chunk. kFrame: patch() is complete and is to be passed on.
  Result Take(std::span<const std::uint8_t> chunk);
  [[nodiscard]] const TemperaturePatch& patch() const { return *newest_patch_; }
  [[nodiscard]] MissingChunks& missing() { return missing_; }
  [[nodiscard]] const MissingChunks& missing() const { return missing_; }
  [[nodiscard]] std::uint64_t bad() const { return bad_; }

 private:
  struct Slot {
    TemperaturePatch patch;
    std::vector<std::uint32_t> newest;  ///< Per tile: the newest frame that contained it; 0: none yet.
    std::uint32_t known = 0;
    std::uint32_t passed_on = 0;
  };
  [[nodiscard]] bool Decode(std::span<const std::uint8_t> chunk);

  std::array<Slot, kMostSlots> slots_;
  const TemperaturePatch* newest_patch_ = nullptr;
  MissingChunks missing_;
  std::uint64_t bad_ = 0;
  // State of the chunk that is being decoded.
  std::uint32_t number_ = 0, frame_ = 0;
  bool last_ = false;
  TemperaturePatchHeader header_;
  std::vector<std::uint32_t> tiles_;
  std::vector<std::uint8_t> texels_;  ///< kTile_B per tile, row by row.
};

}  // namespace fulcrum::link
