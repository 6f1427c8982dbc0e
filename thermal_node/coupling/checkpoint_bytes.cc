#include "thermal_node/coupling/checkpoint_bytes.h"

namespace fulcrum::thermal {
namespace {

/// Bits of a tile's record: awake, and held awake. A tile that is held is awake.
constexpr std::uint32_t kAwake = 1, kHeld = 2;

/// Accepts only values that the solver can have written into a tile.
bool Plausible(const TileState& s, int index, const HeatField& field) {
  if (!AllWithin(s.water, 0.0f, 1.0f) || !AllWithin(s.omega_cell, 0.0f, kOmegaMax) ||
      !AllWithin(s.omega_collagen, 0.0f, kOmegaMax) || !AllWithin(s.charred, 0.0f, 1.0f)) {
    return false;
  }
  const Sheet& sheet = field.sheet();
  const int x0 = index % sheet.tiles_x * kTile, y0 = index / sheet.tiles_x * kTile;
  for (int k = 0; k < kTileCells; ++k) {
    const bool outside = (s.flags[k] & kOutside) != 0;
    if (outside != sheet.IsOutside(x0 + k % kTile, y0 + k / kTile)) return false;
    const float limit = kThetaPlausible * field.material().HeatCapacity(s.water[k]);
    if (!(std::abs(s.enthalpy[k]) <= limit)) return false;
  }
  return true;
}

}  // namespace

std::uint32_t StoredTiles(const HeatField& field) {
  const std::vector<const Tile*> tiles = field.Existing();
  return static_cast<std::uint32_t>(
      std::count_if(tiles.begin(), tiles.end(), [](const Tile* tile) { return !IsBlank(tile->state); }));
}

void PutTiles(const HeatField& field, Writer* writer) {
  for (const Tile* tile : field.Existing()) {
    const TileState& s = tile->state;
    if (IsBlank(s)) continue;
    const auto arrays = FloatArrays(s);
    const std::uint32_t wakefulness = s.awake | (tile->held ? kHeld : 0u);
    std::array<std::uint32_t, 4> record{static_cast<std::uint32_t>(tile->index), 0, wakefulness, s.tented};
    for (std::size_t a = 0; a < arrays.size(); ++a) {
      const float usual = DefaultOf(a);
      const bool worth = std::any_of(arrays[a]->begin(), arrays[a]->end(), [&](float v) { return v != usual; });
      record[1] |= worth ? 1u << a : 0u;
    }
    writer->PutValue(record);
    for (std::size_t a = 0; a < arrays.size(); ++a) {
      if ((record[1] >> a & 1u) != 0) writer->Put(std::span<const float>(*arrays[a]));
    }
    writer->Put(std::span<const std::uint8_t>(s.flags));
  }
}

bool GetTiles(Reader* reader, std::uint32_t count, HeatField* field) {
  TileState state;
  std::int64_t last = -1;
  for (std::uint32_t n = 0; n < count; ++n) {
    std::array<std::uint32_t, 4> record;
    bool good = reader->GetValue(&record) && record[0] > last && record[2] <= (kAwake | kHeld) && record[2] != kHeld &&
                record[3] <= 1 && record[0] < static_cast<std::uint32_t>(field->sheet().tile_count());
    last = record[0];
    const auto arrays = FloatArrays(state);
    for (std::size_t a = 0; good && a < arrays.size(); ++a) {
      arrays[a]->fill(DefaultOf(a));
      if ((record[1] >> a & 1u) != 0) good = reader->Get(std::span<float>(*arrays[a]));
    }
    good = good && reader->Get(std::span<std::uint8_t>(state.flags)) &&
           Plausible(state, static_cast<int>(record[0]), *field);
    if (!good) {
      field->Clear();
      return false;
    }
    state.awake = static_cast<std::uint8_t>(record[2] & kAwake);
    state.tented = static_cast<std::uint8_t>(record[3]);
    field->Restore(static_cast<int>(record[0]), state, (record[2] & kHeld) != 0);
  }
  return true;
}

}  // namespace fulcrum::thermal
