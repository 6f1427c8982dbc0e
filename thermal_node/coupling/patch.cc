#include "thermal_node/coupling/patch.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {
namespace {

constexpr float kTexelZero_C = 20.0f, kTexelPerKelvin = 2.0f;

/// Rounds to 0 … 255; a value that is not finite gives 0 or 255.
std::uint8_t ToByte(float value) {
  return value > 0.0f ? static_cast<std::uint8_t>(std::min(value + 0.5f, 255.0f)) : std::uint8_t{0};
}

/// 0 wet, 128 dry, 255 char.
std::uint8_t Dryness(float water, float charred) { return ToByte(128.0f * (1.0f - water) + 127.0f * charred); }

}  // namespace

float DrawPatch(const HeatField& field, float texel_m, const PatchPlace& place, std::span<std::uint8_t> texels) {
  const Sheet& sheet = field.sheet();
  const float body = field.material().body_C;
  const std::array<std::uint8_t, 4> healthy{ToByte((body - kTexelZero_C) * kTexelPerKelvin), 0, 0, 255};
  std::array<int, kPatchTexels> column;  // cell of each texel column
  for (int x = 0; x < kPatchTexels; ++x) {
    const float s = (static_cast<float>(place.origin_x + x) + 0.5f) * texel_m;
    column[x] = static_cast<int>(std::floor(s / sheet.cell_m)) - sheet.origin_x;
  }
  float highest = 0;
  for (int y = 0; y < kPatchTexels; ++y) {
    const float t = (static_cast<float>(place.origin_y + y) + 0.5f) * texel_m;
    const int iy = static_cast<int>(std::floor(t / sheet.cell_m)) - sheet.origin_y;
    std::uint8_t* out = &texels[static_cast<std::size_t>(4) * kPatchTexels * y];
    int tile_x = -1;
    const Tile* tile = nullptr;
    for (int x = 0; x < kPatchTexels; ++x, out += 4) {
      const int ix = column[x];
      if (ix < 0 || iy < 0) {
        std::copy(healthy.begin(), healthy.end(), out);
        continue;
      }
      if (ix / kTile != tile_x) {
        tile_x = ix / kTile;
        tile = field.Find(tile_x, iy / kTile);
      }
      if (tile == nullptr) {
        std::copy(healthy.begin(), healthy.end(), out);
        continue;
      }
      const int i = ix % kTile, j = iy % kTile, cell = j * kTile + i;
      const float theta = tile->theta[ThetaIndex(i, j)];
      const TileState& s = tile->state;
      highest = std::max(highest, theta);
      out[0] = ToByte((body + theta - kTexelZero_C) * kTexelPerKelvin);
      const float omega = s.omega_collagen[cell];
      out[1] = omega > 0.0f ? ToByte(255.0f * (1.0f - std::exp(-omega))) : 0;
      const bool outside = (s.flags[cell] & kOutside) != 0;
      out[2] = outside ? 0 : Dryness(s.water[cell], s.charred[cell]);
      out[3] = (s.flags[cell] & kRemoved) != 0 ? 0 : 255;
    }
  }
  return body + highest;
}

PatchPlanner::PatchPlanner(const HeatField& field, float texel_m) {
  const Sheet& sheet = field.sheet();
  texels_per_cell_ = sheet.cell_m / texel_m;
  offset_x_ = static_cast<int>(std::floor(static_cast<float>(sheet.origin_x) * texels_per_cell_));
  offset_y_ = static_cast<int>(std::floor(static_cast<float>(sheet.origin_y) * texels_per_cell_));
  const auto places = [&](int offset, int cells) {
    const int end = offset + static_cast<int>(std::ceil(static_cast<float>(cells) * texels_per_cell_));
    return std::max(1, (std::min(end, kAtlasTexels) + kPatchTexels - 1) / kPatchTexels);
  };
  grid_x_ = places(offset_x_, sheet.nx);
  grid_y_ = places(offset_y_, sheet.ny);
  due_.assign(static_cast<std::size_t>(grid_x_) * grid_y_, 0);
  history_ = due_;
  slot_place_.fill(-1);
}

template <class Visit>
void PatchPlanner::ForPlaces(const Tile& tile, const Visit& visit) const {
  const auto first = [&](int tile_coordinate, int offset) {
    return static_cast<float>(tile_coordinate * kTile) * texels_per_cell_ + static_cast<float>(offset);
  };
  const auto place = [](float texel, int limit) {
    return std::clamp(static_cast<int>(std::floor(texel / kPatchTexels)), 0, limit - 1);
  };
  const int y1 = place(first(tile.ty + 1, offset_y_) - 1.0f, grid_y_);
  const int x1 = place(first(tile.tx + 1, offset_x_) - 1.0f, grid_x_);
  for (int y = place(first(tile.ty, offset_y_), grid_y_); y <= y1; ++y) {
    for (int x = place(first(tile.tx, offset_x_), grid_x_); x <= x1; ++x) visit(y * grid_x_ + x);
  }
}

void PatchPlanner::Note(HeatField* field, bool everything) {
  const auto note = [&](const Tile& tile) { ForPlaces(tile, [&](int place) { due_[place] = history_[place] = 1; }); };
  for (const auto& tile : field->tiles()) {
    if (!tile || !(tile->patch_stale || everything)) continue;
    note(*tile);
    tile->patch_stale = false;
  }
}

PatchPlace PatchPlanner::Take(int place) {
  due_[place] = 0;
  auto slot = std::find(slot_place_.begin(), slot_place_.end(), place);
  if (slot == slot_place_.end()) {
    slot = slot_place_.begin() + next_slot_;
    next_slot_ = (next_slot_ + 1) % kPatchSlots;
    *slot = place;
  }
  return {static_cast<std::uint32_t>(slot - slot_place_.begin()),
          static_cast<std::uint32_t>(place % grid_x_) * kPatchTexels,
          static_cast<std::uint32_t>(place / grid_x_) * kPatchTexels};
}

std::optional<PatchPlace> PatchPlanner::RoundRobin(const std::vector<std::uint8_t>& wanted, int* next) {
  const int count = static_cast<int>(wanted.size());
  for (int n = 0; n < count; ++n) {
    const int place = (*next + n) % count;
    if (wanted[place] == 0) continue;
    *next = (place + 1) % count;
    return Take(place);
  }
  return std::nullopt;
}

std::optional<PatchPlace> PatchPlanner::Next(const HeatField& field) {
  hot_turn_ = !hot_turn_;
  if (hot_turn_ && !field.awake().empty()) {
    const Tile* hottest = *std::max_element(field.awake().begin(), field.awake().end(),
                                            [](const Tile* a, const Tile* b) { return a->theta_max < b->theta_max; });
    int hot_place = -1;
    ForPlaces(*hottest, [&](int place) {
      if (hot_place < 0 && due_[place] != 0) hot_place = place;
    });
    if (hot_place >= 0) return Take(hot_place);
  }
  return RoundRobin(due_, &next_due_);
}

std::optional<PatchPlace> PatchPlanner::NextOfHistory() { return RoundRobin(history_, &next_history_); }

}  // namespace fulcrum::thermal
