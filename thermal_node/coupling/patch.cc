#include "thermal_node/coupling/patch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

constexpr float kTexelZero_C = 20.0f, kTexelPerKelvin = 2.0f;

/// Rounds to 0 … 255; a value that is not finite gives 0 or 255.
std::uint8_t ToByte(float value) {
  return value > 0.0f ? static_cast<std::uint8_t>(std::min(value + 0.5f, 255.0f)) : std::uint8_t{0};
}

/// ToByte, vectorised.
[[gnu::always_inline]] inline std::uint32_t ByteOf(float value) {
  const float rounded = (value > 0.0f ? value : 0.0f) + 0.5f;
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(rounded < 255.0f ? rounded : 255.0f));
}

/// Red, green, blue and alpha of a texel as they lie in memory.
[[gnu::always_inline]] inline std::uint32_t Texel(std::uint32_t r, std::uint32_t g, std::uint32_t b, std::uint32_t a) {
  static_assert(std::endian::native == std::endian::little);
  return r | g << 8u | b << 16u | a << 24u;
}

/// A run of texels whose cells are neighbours in one tile.
struct Run {
  int x, count, tx, i;
};

/// Draws the cells of a run, `cell` the first one and `t` its theta. Returns the highest theta, at least 0.
FULCRUM_WIDE
float DrawCells(const TileState& state, const float* __restrict t, int cell, int count, float body,
                std::uint32_t* __restrict out) {
  const float* __restrict water = &state.water[cell];
  const float* __restrict charred = &state.charred[cell];
  const std::uint8_t* __restrict flags = &state.flags[cell];
  alignas(64) float high[kTile] = {};
  for (int n = 0; n < count; ++n) {
    const std::uint32_t red = ByteOf((body + t[n] - kTexelZero_C) * kTexelPerKelvin);
    // 0 wet, 128 dry, 255 char.
    const std::uint32_t blue = ByteOf(128.0f * (1.0f - water[n]) + 127.0f * charred[n]);
    out[n] = Texel(red, 0, blue, 255);
  }
  // A loop of its own: in one the choices would become branches, which are not vectorised.
  for (int n = 0; n < count; ++n) {
    const std::uint32_t flag = flags[n];
    out[n] &= ((flag & kOutside) != 0 ? Texel(255, 255, 0, 255) : ~0u) &
              ((flag & kRemoved) != 0 ? Texel(255, 255, 255, 0) : ~0u);
  }
  for (int n = 0; n < count; ++n) high[n] = t[n] > high[n] ? t[n] : high[n];
  return *std::max_element(high, high + kTile);
}

/// Adds the browning of the collagen, which most cells have not.
void AddBrown(const float* omega, int count, std::uint32_t* out) {
  for (int n = 0; n < count; ++n) {
    if (omega[n] > 0.0f) out[n] |= std::uint32_t{ToByte(255.0f * (1.0f - std::exp(-omega[n])))} << 8u;
  }
}

}  // namespace

float DrawPatch(const HeatField& field, float texel_m, const PatchPlace& place, std::span<std::uint8_t> texels) {
  const Sheet& sheet = field.sheet();
  const float body = field.material().body_C;
  const std::uint32_t healthy = Texel(ToByte((body - kTexelZero_C) * kTexelPerKelvin), 0, 0, 255);
  const auto cell_of = [&](std::uint32_t texel, std::int32_t origin) {
    return static_cast<int>(std::floor((static_cast<float>(texel) + 0.5f) * texel_m / sheet.cell_m)) - origin;
  };
  std::vector<Run> runs;
  runs.reserve(kPatchTexels);
  for (int x = 0; x < kPatchTexels; ++x) {
    const int ix = cell_of(place.origin_x + static_cast<std::uint32_t>(x), sheet.origin_x);
    if (ix < 0) continue;
    if (!runs.empty() && runs.back().x + runs.back().count == x && runs.back().tx == ix / kTile &&
        runs.back().i + runs.back().count == ix % kTile) {
      ++runs.back().count;
    } else {
      runs.push_back({x, 1, ix / kTile, ix % kTile});
    }
  }
  float highest = 0;
  std::array<std::uint32_t, kPatchTexels> row;
  for (int y = 0; y < kPatchTexels; ++y) {
    const int iy = cell_of(place.origin_y + static_cast<std::uint32_t>(y), sheet.origin_y);
    row.fill(healthy);
    for (const Run& run : runs) {
      const Tile* tile = iy < 0 ? nullptr : field.Find(run.tx, iy / kTile);
      if (tile == nullptr) continue;
      const int j = iy % kTile, cell = j * kTile + run.i;
      std::uint32_t* out = &row[static_cast<std::size_t>(run.x)];
      highest =
          std::max(highest, DrawCells(tile->state, &tile->theta[ThetaIndex(run.i, j)], cell, run.count, body, out));
      AddBrown(&tile->state.omega_collagen[cell], run.count, out);
    }
    std::memcpy(&texels[sizeof(row) * static_cast<std::size_t>(y)], row.data(), sizeof(row));
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
