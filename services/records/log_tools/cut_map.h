// What a session has cut, measured from its recording alone: the hole, its centre line, what was left standing in it,
// and how it compares with the metal's way and with what was reported. No class of physics_node or thermal_node is
// used: this is the outsider's measure of both.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "services/records/log_tools/centre_line.h"
#include "services/records/log_tools/mask.h"
#include "services/records/log_tools/recorded_cut.h"

namespace fulcrum::log_tools {

/// Living pieces from this size on are parts of the sheet; smaller ones that nothing holds are islands [m^2].
inline constexpr double kSmallestPiece_m2 = 4e-6;
/// Smaller islands do not part the centre line: no metal can go round them [m^2].
inline constexpr double kSmallestRound_m2 = 0.25e-6;

/// NaN: there is nothing to measure it on.
struct CutFigures {
  double removed_mm2 = 0;
  int islands = 0;  ///< Living pieces below 4 mm^2 that are cut off from the sheet.
  double islands_mm2 = 0;
  int pieces = 0;   ///< Living pieces of 4 mm^2 or more.
  int holes = 0;    ///< Removed pieces.
  int revived = 0;  ///< Texels that were removed and came back.
  /// Share of the metal's energised way that is open: where it went no faster than its power can cut as wide as it is,
  /// and everywhere. Tissue that slips off the metal is not cut by it.
  double open_pct = 0, open_pct_all = 0;
  double way_mm = 0;  ///< Length of the energised way, everywhere.
  double width_mm_p05 = 0, width_mm_p50 = 0, width_mm_p95 = 0;
  double off_way_mm_p95 = 0;  ///< From the centre line to the nearest place where energised metal touched.
  double spot_way_ratio = 0;  ///< Way of the reported place of the current per way of the metal.
  double length_mm = 0;       ///< Of the centre line, from end to end.
  double longest_mm = 0;      ///< The longest that it has been: cuts that meet become one that is shorter.
  double reported_length_mm = 0, length_error_pct = 0;  ///< Of the longest, for the reported length never falls.
  double jump_mm_max = 0;                               ///< Largest rise of the reported length within 50 ms.
  int falls = 0;                                        ///< How often it fell.
  double first_opening_s = 0;                           ///< From the first energised touch to the first texel removed.
  double thermal_step_p50_ms = 0, thermal_step_p99_ms = 0;
};

struct CutMap {
  RecordedCut recorded;
  /// The part of the sheet that is shown: texels [x0, x0 + width) x [y0, y0 + height) of `recorded.texels`.
  int x0 = 0, y0 = 0;
  Mask removed;
  Mask islands;
  CentreLine centre_line;  ///< In texels of `removed`.
  CutFigures figures;

  [[nodiscard]] bool has_cut() const { return figures.removed_mm2 > 0; }
  /// Texels of `removed` to metres of the sheet, and back.
  [[nodiscard]] Vec2d ToSheet(const Vec2d& texel) const {
    return recorded.texels.texel_m * (texel + Vec2d(x0 + recorded.texels.x0, y0 + recorded.texels.y0));
  }
  [[nodiscard]] Vec2d ToTexel(const Vec2f& sheet_m) const {
    return sheet_m.cast<double>() / recorded.texels.texel_m - Vec2d(x0 + recorded.texels.x0, y0 + recorded.texels.y0);
  }
};

[[nodiscard]] CutMap MakeCutMap(RecordedCut recorded);

/// Reads and makes it: see ReadCut.
[[nodiscard]] CutMap ReadCutMap(const std::filesystem::path& recording, const SceneView& scene,
                                const ContactReach& reach = {});

/// Figures by their names in JSON and in the picture, in this order.
[[nodiscard]] std::vector<std::pair<std::string, double>> FigureList(const CutFigures& figures);

/// Flat JSON object; null for what could not be measured.
[[nodiscard]] std::string FiguresJson(const CutMap& map);

}  // namespace fulcrum::log_tools
