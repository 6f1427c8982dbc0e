// Temperature patches for the renderer: which part of the atlas to send, and its texels.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

inline constexpr int kPatchSlots = 4;

struct PatchPlace {
  std::uint32_t slot = 0, origin_x = 0, origin_y = 0;
  bool operator==(const PatchPlace&) const = default;
};

/// Fills texels in the format of TemperaturePatch and returns the highest temperature [C]. Each texel shows the cell
/// under its centre.
float DrawPatch(const HeatField& field, float texel_m, const PatchPlace& place, std::span<std::uint8_t> texels);

/// Decides which patch to send next. The atlas is divided into places of one patch each; a place is due when its tissue
/// has changed since it was last drawn. Every other patch is the hottest place, the others are sent in round-robin
/// order.
class PatchPlanner {
 public:
  PatchPlanner(const HeatField& field, float texel_m);

  /// Notes what has changed since the last call; or, if `everything`, every tile that was ever warm.
  void Note(HeatField* field, bool everything);
  /// Returns the next place that is due and marks it as sent; no value if nothing has changed.
  std::optional<PatchPlace> Next(const HeatField& field);
  /// The next place that was ever warm, in turn: for readers that came late.
  std::optional<PatchPlace> NextOfHistory();

 private:
  template <class Visit>
  void ForPlaces(const Tile& tile, const Visit& visit) const;
  [[nodiscard]] PatchPlace Take(int place);
  [[nodiscard]] std::optional<PatchPlace> RoundRobin(const std::vector<std::uint8_t>& wanted, int* next);

  float texels_per_cell_;
  int offset_x_, offset_y_;  ///< Texel of cell (0, 0).
  int grid_x_ = 0, grid_y_ = 0;
  std::vector<std::uint8_t> due_, history_;  ///< Per place.
  int next_due_ = 0, next_history_ = 0;
  bool hot_turn_ = false;
  std::array<int, kPatchSlots> slot_place_;
  int next_slot_ = 0;
};

}  // namespace fulcrum::thermal
