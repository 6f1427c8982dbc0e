#include "services/transport/link/codec/patch_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "services/transport/link/codec/bits.h"

namespace fulcrum::link {
namespace {

constexpr std::size_t kPlanes = 4;  ///< Bytes per texel.
constexpr std::size_t kEdge = 16;   ///< Edge length of a tile [texels].
constexpr std::size_t kTilesAcross = kPatchTexels / kEdge;
constexpr std::uint32_t kTiles = kTilesAcross * kTilesAcross;
constexpr std::size_t kTexels = kEdge * kEdge;
constexpr std::size_t kRow_B = kPlanes * kPatchTexels, kTileRow_B = kPlanes * kEdge, kTile_B = kPlanes * kTexels;
constexpr std::size_t kPatch_B = kRow_B * kPatchTexels;
/// Unchanged tiles sent with each patch, so that a tile whose repetition was lost too is restored.
constexpr std::uint32_t kPatchRefresh = 1;
constexpr std::size_t kPatchLastAt = 8;  ///< Position of `last` in a chunk [B].

std::size_t PlaceOf(std::uint32_t tile) {
  return (tile / kTilesAcross) * kEdge * kRow_B + (tile % kTilesAcross) * kTileRow_B;
}

/// Encodes one tile, plane by plane: the first byte, then the difference of each byte from the previous one (in the
/// first column from the one above), in as few bits as the plane needs. A plane of one value takes two bytes.
void PutTile(const std::uint8_t* from, std::vector<std::uint8_t>* out) {
  std::array<std::uint32_t, kTexels - 1> differences{};
  for (std::size_t plane = 0; plane < kPlanes; ++plane) {
    const auto at = [&](std::size_t i) { return from[(i / kEdge) * kRow_B + (i % kEdge) * kPlanes + plane]; };
    for (std::size_t i = 1; i < kTexels; ++i) {
      const std::uint8_t before = i % kEdge == 0 ? at(i - kEdge) : at(i - 1);
      differences[i - 1] = Zigzag(static_cast<std::int8_t>(at(i) - before));
    }
    const int width = WidthOf(differences);
    out->push_back(at(0));
    out->push_back(static_cast<std::uint8_t>(width));
    PutBits(differences, width, out);
  }
}

bool TakeTile(ByteReader* in, std::span<std::uint8_t> tile) {
  std::array<std::uint32_t, kTexels - 1> differences{};
  for (std::size_t plane = 0; plane < kPlanes; ++plane) {
    const auto at = [&](std::size_t i) -> std::uint8_t& { return tile[i * kPlanes + plane]; };
    at(0) = in->Number<std::uint8_t>();
    const int width = in->Number<std::uint8_t>();
    if (!in->good() || width > 8 || !TakeBits(in, width, differences)) return false;
    for (std::size_t i = 1; i < kTexels; ++i) {
      const std::uint8_t before = i % kEdge == 0 ? at(i - kEdge) : at(i - 1);
      at(i) = static_cast<std::uint8_t>(before + Unzigzag(differences[i - 1]));
    }
  }
  return true;
}

void PutHeader(std::uint32_t chunk, std::uint32_t frame, const TemperaturePatchHeader& header,
               std::vector<std::uint8_t>* out) {
  ByteWriter w(out);
  w.Number(chunk);
  w.Number(frame);
  w.Number(std::uint8_t{0});
  w.Number(header.stamp.sequence);
  w.Number(header.stamp.epoch);
  w.Number(header.stamp.stamp_ns);
  w.Number(header.topology_revision);
  w.Number(static_cast<std::uint8_t>(header.slot));
  w.Number(static_cast<std::uint8_t>(header.surface));
  w.Number(static_cast<std::uint16_t>(header.origin_x));
  w.Number(static_cast<std::uint16_t>(header.origin_y));
  w.Number(std::bit_cast<std::uint32_t>(header.max_temperature_C));
}

}  // namespace

void PatchSender::Encode(const TemperaturePatch& patch, const SendChunk& send) {
  const TemperaturePatchHeader& header = patch.header;
  if (header.slot >= kMostSlots || patch.texels.size() < kPatch_B) return;
  Slot& slot = slots_[header.slot];
  if (slot.told.empty() || slot.header.surface != header.surface || slot.header.origin_x != header.origin_x ||
      slot.header.origin_y != header.origin_y) {
    slot.told.assign(kPatch_B, 0);
    slot.dirty.assign(kTiles, true);
  }
  slot.header = header;
  for (std::uint32_t i = 0; i < kPatchRefresh; ++i) {
    slot.next_refresh = (slot.next_refresh + 1) % kTiles;
    slot.dirty[slot.next_refresh] = true;
  }
  for (std::uint32_t tile = 0; tile < kTiles; ++tile) {
    for (std::size_t row = 0; row < kEdge; ++row) {
      const std::size_t at = PlaceOf(tile) + row * kRow_B;
      if (std::memcmp(slot.told.data() + at, patch.texels.data() + at, kTileRow_B) == 0) continue;
      std::memcpy(slot.told.data() + at, patch.texels.data() + at, kTileRow_B);
      slot.dirty[tile] = true;
    }
  }
  Emit(&slot, send);
}

void PatchSender::Flush(const SendChunk& send) {
  for (Slot& slot : slots_) {
    if (std::find(slot.dirty.begin(), slot.dirty.end(), true) != slot.dirty.end()) Emit(&slot, send);
  }
}

void PatchSender::Emit(Slot* slot, const SendChunk& send) {
  ++frame_;
  const auto begin = [&] {
    chunk_.clear();
    PutHeader(sent_.Begin(), frame_, slot->header, &chunk_);
  };
  begin();
  for (std::uint32_t tile = 0; tile < kTiles; ++tile) {
    if (!slot->dirty[tile]) continue;
    slot->dirty[tile] = false;
    block_.clear();
    block_.push_back(static_cast<std::uint8_t>(tile));
    PutTile(slot->told.data() + PlaceOf(tile), &block_);
    if (chunk_.size() + block_.size() > kChunk_B) {
      send(chunk_);
      begin();
    }
    sent_.Tell(slot->header.slot * kTiles + tile);
    chunk_.insert(chunk_.end(), block_.begin(), block_.end());
  }
  chunk_[kPatchLastAt] = 1;
  send(chunk_);
}

void PatchSender::Repeat(std::uint32_t chunk) {
  const std::vector<BlockId>* blocks = sent_.Find(chunk);
  if (blocks == nullptr) return RepeatAll();
  for (const BlockId block : *blocks) {
    Slot& slot = slots_[block / kTiles];
    if (!slot.dirty.empty()) slot.dirty[block % kTiles] = true;
  }
}

void PatchSender::RepeatAll() {
  for (Slot& slot : slots_) slot.dirty.assign(slot.dirty.size(), true);
}

bool PatchReceiver::Decode(std::span<const std::uint8_t> chunk) {
  ByteReader in(chunk);
  number_ = in.Number<std::uint32_t>();
  frame_ = in.Number<std::uint32_t>();
  const auto last = in.Number<std::uint8_t>();
  header_.stamp.sequence = in.Number<std::uint64_t>();
  header_.stamp.epoch = in.Number<std::uint64_t>();
  header_.stamp.stamp_ns = in.Number<std::int64_t>();
  header_.topology_revision = in.Number<std::uint64_t>();
  header_.slot = in.Number<std::uint8_t>();
  header_.surface = static_cast<BurntSurface>(in.Number<std::uint8_t>());
  header_.origin_x = in.Number<std::uint16_t>();
  header_.origin_y = in.Number<std::uint16_t>();
  header_.max_temperature_C = std::bit_cast<float>(in.Number<std::uint32_t>());
  last_ = last != 0;
  tiles_.clear();
  texels_.clear();
  constexpr std::uint32_t kFarthest = kAtlasTexels - kPatchTexels;
  if (!in.good() || number_ == 0 || frame_ == 0 || last > 1 || header_.slot >= kMostSlots ||
      header_.surface > BurntSurface::kSolids || header_.origin_x > kFarthest || header_.origin_y > kFarthest ||
      !std::isfinite(header_.max_temperature_C)) {
    return false;
  }
  while (!in.empty()) {
    tiles_.push_back(in.Number<std::uint8_t>());
    texels_.resize(texels_.size() + kTile_B);
    if (!TakeTile(&in, std::span(texels_).last(kTile_B))) return false;
  }
  return true;
}

PatchReceiver::Result PatchReceiver::Take(std::span<const std::uint8_t> chunk) {
  if (!Decode(chunk)) {
    ++bad_;
    return Result::kBad;
  }
  missing_.Note(number_);
  Slot& slot = slots_[header_.slot];
  TemperaturePatchHeader& known = slot.patch.header;
  if (slot.newest.empty() || known.surface != header_.surface || known.origin_x != header_.origin_x ||
      known.origin_y != header_.origin_y) {
    if (frame_ <= slot.passed_on) return Result::kPart;  // The patch was at another place then.
    slot.patch.texels.assign(kPatch_B, 0);
    slot.newest.assign(kTiles, 0);
    slot.known = 0;
    known = header_;
  }
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    std::uint32_t& newest = slot.newest[tiles_[t]];
    if (frame_ < newest) continue;  // A newer frame arrived first.
    slot.known += newest == 0 ? 1 : 0;
    newest = frame_;
    for (std::size_t row = 0; row < kEdge; ++row) {
      std::memcpy(slot.patch.texels.data() + PlaceOf(tiles_[t]) + row * kRow_B,
                  texels_.data() + t * kTile_B + row * kTileRow_B, kTileRow_B);
    }
  }
  if (!last_ || slot.known < kTiles || frame_ <= slot.passed_on) return Result::kPart;
  slot.passed_on = frame_;
  known = header_;
  newest_patch_ = &slot.patch;
  return Result::kFrame;
}

}  // namespace fulcrum::link
