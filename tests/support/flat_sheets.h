// Scenes of flat sheets without an organ.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "services/base/core/sheets.h"
#include "services/scene/builder/build.h"

namespace fulcrum {

/// A flat sheet of `rows` x `cols` nodes from `corner`, a step of each along the two vectors; ends and sides held.
inline scene::SheetBody FlatSheet(std::string name, int rows, int cols, const Vec3d& corner, const Vec3d& row_step,
                                  const Vec3d& col_step) {
  scene::SheetBody sheet;
  sheet.name = std::move(name);
  sheet.grid.rows = rows;
  sheet.grid.cols = cols;
  sheet.grid.bending_row_stride = sheet.grid.bending_col_stride = 1;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) sheet.nodes.push_back(corner + r * row_step + c * col_step);
  }
  return sheet;
}

/// Settings for sheets alone, without gravity.
inline scene::SceneSettings SheetSettings(PhysicsMode mode) {
  scene::SceneSettings settings = scene::Small();
  settings.name = "sheets";
  settings.has_organ = false;
  settings.structures.clear();
  settings.script.clear();
  settings.planned_line.clear();
  settings.physics.mode = mode;
  settings.physics.gravity = Vec3f::Zero();
  return settings;
}

/// A particle of a sheet's grid.
inline Index SheetParticle(const SheetScene& scene, const SheetPart& sheet, std::uint32_t row, std::uint32_t col) {
  return scene.membrane.first + (sheet.first_row + row) * scene.membrane.cols + col;
}

/// Distance of nodes of the scenes below, along rows and columns [m].
inline constexpr double kFlatCell_m = 0.0015;

/// A sheet of 30 x 14 nodes in the plane z = 0, its rim held, and a band across it, `gap` above, which is longer than
/// the sheet is wide; its ends are held.
inline scene::SceneData SheetAndBand(double gap_m, const Vec3f& gravity = Vec3f::Zero()) {
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.gravity = gravity;
  constexpr double h = kFlatCell_m;
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(FlatSheet("lower", 30, 14, Vec3d(-6.5 * h, -14.5 * h, 0), Vec3d(0, h, 0), Vec3d(h, 0, 0)));
  anatomy.sheets.push_back(FlatSheet("band", 25, 7, Vec3d(-12 * h, -3 * h, gap_m), Vec3d(h, 0, 0), Vec3d(0, h, 0)));
  anatomy.sheets.back().sides_held = false;
  return scene::AssembleScene(settings, anatomy);
}

/// Lets the held nodes of a sheet move.
inline void Free(scene::SceneData* data, const SheetPart& sheet) {
  const SceneView scene = data->View();
  const float inner = scene.inverse_mass[SheetParticle(scene, sheet, sheet.rows / 2, sheet.cols / 2)];
  for (std::uint32_t row = 0; row < sheet.rows; ++row) {
    for (std::uint32_t col = 0; col < sheet.cols; ++col) {
      float& w = data->inverse_mass[SheetParticle(scene, sheet, row, col)];
      if (!(w > 0.0f)) w = inner;
    }
  }
}

}  // namespace fulcrum
