// The cut of a session, measured from its recording alone: the hole, its centre line, the islands in it, and a
// comparison with the path of the metal and with the reported values. No class of physics_node or thermal_node is used,
// so the result is independent of both.
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

/// Living pieces of at least this size are parts of the sheet; smaller unconnected ones are islands [m^2].
inline constexpr double kSmallestPiece_m2 = 4e-6;
/// Smaller islands do not divide the centre line, because no metal can go around them [m^2].
inline constexpr double kSmallestRound_m2 = 0.25e-6;

/// Half of a hook's width and what its heat removes beside it [m]: tissue that a cut removes farther from the metal was
/// removed by current that strayed. Assumed.
inline constexpr double kBesideMetal_m = 0.8e-3;

/// Figures of a cut. NaN: the recording contains nothing to measure the figure on.
struct CutFigures {
  double removed_mm2 = 0;
  int islands = 0;  ///< Living pieces below 4 mm^2 that are cut off from the sheet.
  double islands_mm2 = 0;
  int pieces = 0;   ///< Living pieces of 4 mm^2 or more.
  int holes = 0;    ///< Removed pieces.
  int revived = 0;  ///< Texels that were removed and later shown as tissue again.
  /// Share of the energised path of the metal that is open: of the part on which the metal moved no faster than its
  /// power can cut at its own width, and of the whole path. Tissue that slips off the metal is not cut by it.
  double open_pct = 0, open_pct_all = 0;
  double way_mm = 0;  ///< Length of the whole energised path.
  double width_mm_p05 = 0, width_mm_p50 = 0, width_mm_p95 = 0;
  double off_way_mm_p95 = 0;  ///< From the centre line to the nearest place where energised metal touched.
  /// Share of the hole farther than kBesideMetal_m from every place that energised metal touched.
  double beyond_metal_pct = 0;
  double spot_way_ratio = 0;  ///< Path length of the reported place of the current divided by that of the metal.
  double length_mm = 0;       ///< Length of the centre line, from end to end.
  double longest_mm = 0;      ///< Largest value of that length: cuts that merge have a shorter common line.
  /// The error refers to `longest_mm`, because the reported length never decreases.
  double reported_length_mm = 0, length_error_pct = 0;
  double jump_mm_max = 0;      ///< Largest rise of the reported length within 50 ms.
  int falls = 0;               ///< Number of decreases of the reported length.
  double first_opening_s = 0;  ///< Time from the first energised touch to the first texel removed.
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
  /// Converts texels of `removed` to metres of the sheet, and back.
  [[nodiscard]] Vec2d ToSheet(const Vec2d& texel) const {
    return recorded.texels.texel_m * (texel + Vec2d(x0 + recorded.texels.x0, y0 + recorded.texels.y0));
  }
  [[nodiscard]] Vec2d ToTexel(const Vec2f& sheet_m) const {
    return sheet_m.cast<double>() / recorded.texels.texel_m - Vec2d(x0 + recorded.texels.x0, y0 + recorded.texels.y0);
  }
};

[[nodiscard]] CutMap MakeCutMap(RecordedCut recorded);

/// Reads a recording and makes its map: see ReadCut.
[[nodiscard]] CutMap ReadCutMap(const std::filesystem::path& recording, const SceneView& scene,
                                const ContactReach& reach = {});

/// The figures with their names in JSON and in the picture, in this order.
[[nodiscard]] std::vector<std::pair<std::string, double>> FigureList(const CutFigures& figures);

/// The figures as a flat JSON object; null for figures that could not be measured.
[[nodiscard]] std::string FiguresJson(const CutMap& map);

}  // namespace fulcrum::log_tools
