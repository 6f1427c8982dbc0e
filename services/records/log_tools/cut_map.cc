#include "services/records/log_tools/cut_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "services/records/log_tools/cut_figures.h"
#include "services/records/log_tools/text.h"

namespace fulcrum::log_tools {
namespace {

/// Margin shown around the changed part of the sheet [m].
constexpr double kMargin_m = 2e-3;

/// Crops to the part of the sheet that has changed.
void CropTo(const RecordedCut& cut, CutMap* map) {
  const SheetTexels& texels = cut.texels;
  Eigen::Vector2i low(texels.width, texels.height), high(-1, -1);
  const auto add = [&](int x, int y) {
    low = low.cwiseMin(Eigen::Vector2i(x, y));
    high = high.cwiseMax(Eigen::Vector2i(x, y));
  };
  for (int y = 0; y < texels.height; ++y) {
    for (int x = 0; x < texels.width; ++x) {
      if (texels.removed[texels.Index(x, y)] != 0) add(x, y);
    }
  }
  const auto add_place = [&](const Vec2f& place) {
    const Vec2d texel = place.cast<double>() / texels.texel_m;
    add(static_cast<int>(std::floor(texel.x())) - texels.x0, static_cast<int>(std::floor(texel.y())) - texels.y0);
  };
  for (const CurrentSample& sample : cut.current) {
    if (sample.touching && sample.energised()) add_place(sample.material);
  }
  for (const MetalFrame& frame : cut.metal) {
    if (frame.mode == CauteryMode::kOff) continue;
    for (const Vec2f& place : frame.touched) add_place(place);
  }
  if (high.x() < 0) {
    low.setZero();
    high = low;
  }
  // The border counts as living tissue on all sides, even where the hole reaches the end of the sheet: tissue connected
  // to it belongs to the sheet.
  const int margin = static_cast<int>(std::lround(kMargin_m / texels.texel_m));
  map->x0 = low.x() - margin;
  map->y0 = low.y() - margin;
  map->removed = Mask(high.x() - low.x() + 1 + 2 * margin, high.y() - low.y() + 1 + 2 * margin);
  for (int y = 0; y < map->removed.height; ++y) {
    for (int x = 0; x < map->removed.width; ++x) {
      const int column = x + map->x0, row = y + map->y0;
      if (column < 0 || row < 0 || column >= texels.width || row >= texels.height) continue;
      map->removed.Put(x, y, texels.removed[texels.Index(column, row)] != 0);
    }
  }
}

/// Living pieces that are not connected to the surrounding sheet.
struct Islands {
  Mask texels;
  Mask hole;  ///< Removed texels, and islands that are too small to go around.
  int count = 0, pixels = 0;
  int pieces = 0;  ///< Number of pieces that are large enough to be parts of the sheet, including the sheet.
};

Islands FindIslands(const Mask& removed, double texel_m) {
  const double texel_m2 = texel_m * texel_m;
  const Pieces living = FindPieces(removed, false, Neighbours::kFour);
  Islands islands{Mask(removed.width, removed.height), removed};
  std::vector<std::uint8_t> is_island(living.pieces.size()), is_filled(living.pieces.size());
  for (std::size_t i = 0; i < living.pieces.size(); ++i) {
    const Piece& piece = living.pieces[i];
    const double area_m2 = piece.pixels * texel_m2;
    if (piece.at_border || area_m2 >= kSmallestPiece_m2) {
      ++islands.pieces;
      continue;
    }
    is_island[i] = 1;
    is_filled[i] = area_m2 < kSmallestRound_m2 ? 1 : 0;
    ++islands.count;
    islands.pixels += piece.pixels;
  }
  for (std::size_t i = 0; i < living.label.size(); ++i) {
    if (living.label[i] < 0) continue;
    const auto piece = static_cast<std::size_t>(living.label[i]);
    islands.texels.set[i] = is_island[piece];
    if (is_filled[piece] != 0) islands.hole.set[i] = 1;
  }
  return islands;
}

CentreLine LineOf(const Mask& hole, double texel_m) {
  return FindCentreLine(hole, {.smooth = 1e-3 / texel_m, .spur = 0.2e-3 / texel_m});
}

/// Length of the longest centre line that the hole has had, evaluated every half second [texels].
double LongestLine(const CutMap& map) {
  constexpr float kLook_s = 0.5f;
  const SheetTexels& texels = map.recorded.texels;
  double longest = map.centre_line.length();
  if (texels.removed_s.empty()) return longest;
  const auto shown_s = [&](int x, int y) { return texels.removed_s[texels.Index(x + map.x0, y + map.y0)]; };
  float first = std::numeric_limits<float>::infinity(), last = 0;
  for (int y = 0; y < map.removed.height; ++y) {
    for (int x = 0; x < map.removed.width; ++x) {
      if (!map.removed.At(x, y)) continue;
      first = std::min(first, shown_s(x, y));
      last = std::max(last, shown_s(x, y));
    }
  }
  for (float time_s = first + kLook_s; time_s < last; time_s += kLook_s) {
    Mask then(map.removed.width, map.removed.height);
    for (int y = 0; y < then.height; ++y) {
      for (int x = 0; x < then.width; ++x) then.Put(x, y, map.removed.At(x, y) && shown_s(x, y) <= time_s);
    }
    const double texel_m = texels.texel_m;
    longest = std::max(longest, LineOf(FindIslands(then, texel_m).hole, texel_m).length());
  }
  return longest;
}

}  // namespace

CutMap MakeCutMap(RecordedCut recorded) {
  CutMap map;
  CropTo(recorded, &map);
  map.recorded = std::move(recorded);
  const double texel_m = map.recorded.texels.texel_m;
  const auto removed = std::count(map.removed.set.begin(), map.removed.set.end(), std::uint8_t{1});
  map.figures.removed_mm2 = 1e6 * texel_m * texel_m * static_cast<double>(removed);
  map.figures.holes = static_cast<int>(FindPieces(map.removed, true, Neighbours::kEight).pieces.size());
  Islands islands = FindIslands(map.removed, texel_m);
  map.figures.islands = islands.count;
  map.figures.islands_mm2 = 1e6 * texel_m * texel_m * islands.pixels;
  map.figures.pieces = islands.pieces;
  map.islands = std::move(islands.texels);
  map.centre_line = LineOf(islands.hole, texel_m);
  map.figures.longest_mm = 1e3 * texel_m * LongestLine(map);
  MeasureCut(&map);
  return map;
}

CutMap ReadCutMap(const std::filesystem::path& recording, const SceneView& scene, const ContactReach& reach) {
  return MakeCutMap(ReadCut(recording, scene, reach));
}

std::vector<std::pair<std::string, double>> FigureList(const CutFigures& f) {
  return {{"removed_mm2", f.removed_mm2},
          {"islands", f.islands},
          {"islands_mm2", f.islands_mm2},
          {"pieces", f.pieces},
          {"holes", f.holes},
          {"revived", f.revived},
          {"open_pct", f.open_pct},
          {"open_pct_all", f.open_pct_all},
          {"way_mm", f.way_mm},
          {"width_mm_p05", f.width_mm_p05},
          {"width_mm_p50", f.width_mm_p50},
          {"width_mm_p95", f.width_mm_p95},
          {"off_way_mm_p95", f.off_way_mm_p95},
          {"beyond_metal_pct", f.beyond_metal_pct},
          {"spot_way_ratio", f.spot_way_ratio},
          {"length_mm", f.length_mm},
          {"longest_mm", f.longest_mm},
          {"reported_length_mm", f.reported_length_mm},
          {"length_error_pct", f.length_error_pct},
          {"jump_mm_max", f.jump_mm_max},
          {"falls", f.falls},
          {"first_opening_s", f.first_opening_s},
          {"thermal_step_p50_ms", f.thermal_step_p50_ms},
          {"thermal_step_p99_ms", f.thermal_step_p99_ms}};
}

std::string FiguresJson(const CutMap& map) {
  std::string json = "{\n  \"session\": " + JsonString(map.recorded.session_id);
  for (const auto& [name, value] : FigureList(map.figures)) {
    json += ",\n  \"" + name + "\": ";
    PutJson(value, 0, &json);
  }
  return json + "\n}\n";
}

}  // namespace fulcrum::log_tools
