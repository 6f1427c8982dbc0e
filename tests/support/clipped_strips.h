// Two strips of tissue face to face, a clip applier that clips them together and a grasper that pulls one of them.
#pragma once

#include "tests/support/flat_sheets.h"

namespace fulcrum {

/// Times of the script [s]: the applier has closed, has opened and is away; the grasper holds, and has pulled.
inline constexpr double kClipped_s = 0.7, kClipFree_s = 1.3, kGripped_s = 2, kPulled_s = 4;
/// Distance of the strips [m].
inline constexpr double kStripGap_m = 0.001;

/// Planes x = 0 ("wall", its ends held) and x = kStripGap_m ("strip", free), along y, 7 mm wide, cells of 1 mm. The
/// applier (tool 0) comes along -z at y = 0; the grasper (tool 1) takes the strip beyond the wall's end and moves by
/// `pull`.
inline scene::SceneData ClippedStrips(PhysicsMode mode, const Vec3f& pull, ToolKind kind = ToolKind::kClipApplier) {
  constexpr double h = 0.001;
  scene::SceneSettings settings = SheetSettings(mode);
  const Vec3f middle(0.5f * static_cast<float>(kStripGap_m), 0, 0);
  const Vec3f grip(static_cast<float>(kStripGap_m), static_cast<float>(28 * h), 0);
  const Vec3f tip(0, 0, -0.005f), away(0, 0, 0.06f);
  settings.physics.membrane_Et_N_per_m = 300;
  settings.tools = {};
  settings.tools[0] = scene::DefaultTool(kind, middle + Vec3f(0, 0, 0.2f));
  settings.tools[0].tip_length_m = 0.008f;
  settings.tools[0].tip_radius_m = 0.001f;
  settings.tools[1] = scene::DefaultTool(ToolKind::kGrasper, grip + Vec3f(0, 0, 0.2f));
  const auto key = [&](double time_s, int tool, const Vec3f& place, double jaw_rad) {
    settings.script.push_back({.time_s = time_s, .tool = tool, .world_m = place, .jaw_rad = jaw_rad});
  };
  key(0, 0, middle + away, 1.2);
  key(0.3, 0, middle + tip, 1.2);
  key(0.6, 0, middle + tip, 0);
  key(0.8, 0, middle + tip, 0);
  key(1.0, 0, middle + tip, 1.2);
  key(kClipFree_s, 0, middle + away, 1.2);
  key(0, 1, grip + away, 0.6);
  key(kClipFree_s, 1, grip + away, 0.6);
  key(1.6, 1, grip + tip, 0.6);
  key(1.8, 1, grip + tip, 0);
  key(kGripped_s, 1, grip + tip, 0);
  key(kPulled_s, 1, grip + tip + pull, 0);
  settings.script_duration_s = kPulled_s + 1;
  scene::Anatomy anatomy;
  const Vec3d along(0, h, 0), across(0, 0, h);
  anatomy.sheets.push_back(FlatSheet("wall", 40, 8, Vec3d(0, -20.5 * h, -7 * h), along, across));
  anatomy.sheets.back().sides_held = false;
  anatomy.sheets.push_back(FlatSheet("strip", 37, 8, Vec3d(kStripGap_m, -4.5 * h, -7 * h), along, across));
  anatomy.sheets.back().sides_held = false;
  scene::SceneData data = scene::AssembleScene(settings, anatomy);
  Free(&data, data.View().sheets[1]);
  return data;
}

}  // namespace fulcrum
