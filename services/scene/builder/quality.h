// Figures of a compiled scene, for the compiler's report and for tests.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// Metric of the atlas on the membrane at rest, at the middle of one cell of the grid: the length of a step (ds, dt) in
/// material coordinates is sqrt(ss ds^2 + 2 st ds dt + tt dt^2) (first fundamental form). 1, 0, 1 where the atlas is
/// isometric.
struct AtlasMetric {
  double ss = 1, st = 0, tt = 1;
  [[nodiscard]] double area() const;  ///< True area divided by area in the atlas.
  /// Smallest and largest true length divided by length in the atlas.
  [[nodiscard]] std::array<double, 2> stretches() const;
};
/// Metric of each cell, [(rows - 1) * (cols - 1)], row by row.
std::vector<AtlasMetric> MeasureAtlas(const SceneView& scene);

struct SceneQuality {
  std::size_t vertices, organ_vertices, tets, organ_springs, membrane_springs, bending, bindings;
  std::array<std::size_t, 4> colours;  ///< Number of colours of tets, organ springs, bending and bindings.
  double organ_volume_m3;
  double least_tet_volume_m3;
  std::size_t inverted_tets;                         ///< Number of tetrahedra without positive volume.
  double least_dihedral_deg, largest_dihedral_deg;   ///< Over all tetrahedra; 70.5 in a regular one.
  double mean_least_dihedral_deg;                    ///< Mean of each tetrahedron's smallest angle.
  double least_edge_m, largest_edge_m, mean_edge_m;  ///< Edges of the organ.
  double least_binding_m, largest_binding_m;
  /// Material length divided by rest length of the membrane's springs: 1 where the flattening is isometric.
  double least_flat_ratio, largest_flat_ratio;
  double rms_flat_error;                              ///< Root mean square of that ratio minus 1.
  double least_atlas_stretch, largest_atlas_stretch;  ///< Over all cells and directions.
  double least_atlas_area, largest_atlas_area;        ///< Over all cells.
  std::array<double, 2> sheet_m;                      ///< Extent of the flattened sheet.
  double least_weight;     ///< Smallest weight of the embedded surface: below 0 outside the tetrahedra.
  double largest_reach_m;  ///< Largest distance of the script's tips from the trocar.
};

SceneQuality Measure(const SceneView& scene);

/// By sheet that the scene lists: something keeps it in its place, a fixed node or a binding.
[[nodiscard]] std::vector<bool> SheetsHeld(const SceneView& scene);

/// The figures as text, one line per figure, each with its unit.
std::string Describe(const SceneView& scene, const SceneQuality& quality);

}  // namespace fulcrum::scene
