// The shipped procedural scenes as settings. deploy/scenes/*.yaml contain the same; a test compares them.
#include <numbers>

#include "services/scene/builder/scene_settings.h"

namespace fulcrum::scene {
namespace {

// Converts as the YAML reader does, so that both give the same bits.
double Millimetres(double mm) { return mm * 1e-3; }
double Degrees(double deg) { return deg * (std::numbers::pi / 180.0); }

/// Appends script keys one after the other.
class ScriptWriter {
 public:
  explicit ScriptWriter(std::vector<ScriptKeySettings>* keys) : keys_(keys) {}

  void Grasper(double time_s, float s, float t, double height_mm, double jaw_deg,
               const Vec3d& offset_mm = Vec3d::Zero()) {
    keys_->push_back({time_s, 0, std::nullopt, Vec2f(s, t), Millimetres(height_mm), (offset_mm * 1e-3).cast<float>(),
                      Degrees(jaw_deg), kPedalNone, 0});
  }
  void Hook(double time_s, float s, float t, double height_mm, double cut_W = 0,
            const Vec3d& offset_mm = Vec3d::Zero()) {
    keys_->push_back({time_s, 1, std::nullopt, Vec2f(s, t), Millimetres(height_mm), (offset_mm * 1e-3).cast<float>(), 0,
                      cut_W > 0 ? kPedalCut : kPedalNone, cut_W});
  }

 private:
  std::vector<ScriptKeySettings>* keys_;
};

PhysicsParams AccuratePhysics() {
  PhysicsParams physics;
  physics.mode = PhysicsMode::kAccurate;
  physics.damping_per_s = 20.0f;
  physics.membrane_stiffening = 1.0f;
  physics.membrane_prestrain = 0.04f;
  return physics;
}

}  // namespace

ToolDescription DefaultTool(ToolKind kind, const Vec3f& p_WP) {
  switch (kind) {
    case ToolKind::kGrasper:
      return {kind, p_WP, 0.0025f, 0.330f, 0.0015f, 0.018f};
    case ToolKind::kHook:
      return {kind, p_WP, 0.0025f, 0.330f, 0.0006f, 0.005f};
    case ToolKind::kScissors:
      return {kind, p_WP, 0.0025f, 0.330f, 0.0010f, 0.016f};
    case ToolKind::kScope:
      return {kind, p_WP, 0.005f, 0.330f, 0.005f, 0.005f};
    case ToolKind::kSuction:
      return {kind, p_WP, 0.0025f, 0.330f, 0.0025f, 0.018f};
    case ToolKind::kClipApplier:
      return {kind, p_WP, 0.0025f, 0.330f, 0.0010f, 0.008f};
    case ToolKind::kNone:
      break;
  }
  return {ToolKind::kNone, p_WP, 0, 0, 0, 0};
}

SceneSettings BuiltIn() {
  SceneSettings scene;
  scene.physics = AccuratePhysics();
  scene.name = "built-in";
  scene.description = "Procedural rectum and membrane at the size of the paper's Table 3";
  scene.tube = {.rings = 43,
                .segments = 24,
                .length_m = Millimetres(200),
                .outer_radius_m = Millimetres(18),
                .wall_m = Millimetres(3),
                .sagittal_bend_m = Millimetres(12),
                .lateral_bend_m = Millimetres(4),
                .fold_count = 5,
                .fold_depth_m = Millimetres(1.2)};
  scene.membrane = {.rows = 289,
                    .cols = 64,
                    .width_m = Millimetres(69),
                    .gap_m = Millimetres(5.5),
                    .density_kg_m2 = 0.5,
                    .bending_row_stride = 4,
                    .bending_col_stride = 7,
                    .binding_row_stride = 4,
                    .binding_col_stride = 4,
                    .binding_reach_m = Millimetres(6.8)};
  scene.structures = {
      {ProtectedKind::kUreter,
       Millimetres(2.5),
       Millimetres(3),
       {{0.10f, 0.f}, {0.13f, 0.3f}, {0.11f, 0.6f}, {0.15f, 1.f}}},
      {ProtectedKind::kUreter,
       Millimetres(2.5),
       Millimetres(3),
       {{0.90f, 0.f}, {0.88f, 0.35f}, {0.90f, 0.65f}, {0.86f, 1.f}}},
      {ProtectedKind::kNerve,
       Millimetres(1),
       Millimetres(3),
       {{0.22f, 0.f}, {0.16f, 0.4f}, {0.17f, 0.7f}, {0.26f, 1.f}}},
      {ProtectedKind::kNerve,
       Millimetres(1),
       Millimetres(3),
       {{0.80f, 0.f}, {0.84f, 0.4f}, {0.83f, 0.7f}, {0.74f, 1.f}}},
      {ProtectedKind::kNerve, Millimetres(0.6), Millimetres(3), {{0.84f, 0.40f}, {0.87f, 0.52f}, {0.85f, 0.7f}}},
      {ProtectedKind::kNerve, Millimetres(0.6), Millimetres(3), {{0.16f, 0.40f}, {0.13f, 0.55f}, {0.15f, 0.7f}}},
  };
  scene.tools = {DefaultTool(ToolKind::kGrasper, Vec3f(-0.085f, -0.045f, 0.115f)),
                 DefaultTool(ToolKind::kHook, Vec3f(0.098f, 0.0f, 0.057f))};
  scene.render.scope_tip_W = Vec3f(0.004f, -0.060f, 0.082f);
  scene.render.scope_target_W = Vec3f(0.0f, 0.002f, 0.022f);
  ScriptWriter key(&scene.script);
  // Left hand: descends with the jaws open, presses a fold into them, closes them, lifts the sheet up and to the left,
  // holds it while the hook works, lowers it again.
  key.Grasper(0.0, 0.36f, 0.50f, 55, 50);
  key.Grasper(1.2, 0.36f, 0.50f, 12, 50);
  key.Grasper(2.0, 0.36f, 0.50f, -2.5, 50);
  key.Grasper(2.3, 0.36f, 0.50f, -2.5, 50);
  key.Grasper(2.9, 0.36f, 0.50f, -2.5, 0.0);
  key.Grasper(3.2, 0.36f, 0.50f, -2.0, 0.0);
  key.Grasper(5.8, 0.36f, 0.50f, 20, 0.0, Vec3d(-4, 2, 6));
  key.Grasper(15.0, 0.36f, 0.50f, 20, 0.0, Vec3d(-4, 2, 6));
  key.Grasper(16.2, 0.36f, 0.50f, 4, 0.0, Vec3d(-1, 0, 0));
  key.Grasper(16.6, 0.36f, 0.50f, 4, 0.0, Vec3d(-1, 0, 0));
  key.Grasper(17.2, 0.36f, 0.50f, 5, 50, Vec3d(-1, 0, 0));
  key.Grasper(19.0, 0.36f, 0.50f, 50, 50);
  key.Grasper(20.0, 0.36f, 0.50f, 55, 50);
  // Right hand: waits beside, pierces the sheet with the end of its foot beside the tent, cuts 30 mm along the organ at
  // 4 mm/s, lifts off. From a low trocar at its side the foot points down into the sheet, the heel above it.
  key.Hook(0.0, 0.68f, 0.40f, 20, 0, Vec3d(0, -60, 0));
  key.Hook(4.0, 0.68f, 0.40f, 20, 0, Vec3d(0, -60, 0));
  key.Hook(6.3, 0.56f, 0.42f, 10);
  key.Hook(7.0, 0.56f, 0.42f, 3.0);
  key.Hook(7.3, 0.56f, 0.42f, 3.0, 35);
  key.Hook(14.8, 0.56f, 0.575f, 3.0, 35);
  key.Hook(14.9, 0.56f, 0.575f, 3.0);
  key.Hook(15.8, 0.58f, 0.575f, 14);
  key.Hook(18.0, 0.68f, 0.50f, 20);
  key.Hook(20.0, 0.68f, 0.50f, 20);
  scene.script_duration_s = 20;
  return scene;
}

SceneSettings Small() {
  SceneSettings scene = BuiltIn();
  scene.name = "small";
  scene.description = "A tenth of the built-in scene, for tests";
  scene.tube = {.rings = 11,
                .segments = 10,
                .length_m = Millimetres(80),
                .outer_radius_m = Millimetres(10),
                .wall_m = Millimetres(3),
                .sagittal_bend_m = Millimetres(3),
                .lateral_bend_m = Millimetres(1),
                .fold_count = 2,
                .fold_depth_m = Millimetres(0.6)};
  scene.membrane = {.rows = 73,
                    .cols = 25,
                    .width_m = Millimetres(43),
                    .gap_m = Millimetres(4.5),
                    .density_kg_m2 = 0.5,
                    .bending_row_stride = 4,
                    .bending_col_stride = 4,
                    .binding_row_stride = 3,
                    .binding_col_stride = 3,
                    .binding_reach_m = Millimetres(5.8)};
  scene.structures.resize(4);
  scene.tools = {DefaultTool(ToolKind::kGrasper, Vec3f(-0.075f, -0.045f, 0.110f)),
                 DefaultTool(ToolKind::kHook, Vec3f(0.097f, 0.0f, 0.047f))};
  scene.render.scope_tip_W = Vec3f(0.004f, -0.055f, 0.070f);
  scene.render.scope_target_W = Vec3f(0.0f, 0.002f, 0.012f);
  scene.script.clear();
  ScriptWriter key(&scene.script);
  key.Grasper(0.0, 0.33f, 0.50f, 20, 50);
  key.Grasper(0.6, 0.33f, 0.50f, -2.0, 50);
  key.Grasper(0.8, 0.33f, 0.50f, -2.0, 50);
  key.Grasper(1.1, 0.33f, 0.50f, -2.0, 0.0);
  key.Grasper(2.0, 0.33f, 0.50f, 9, 0.0, Vec3d(-4, 0, 2));
  key.Grasper(4.9, 0.33f, 0.50f, 9, 0.0, Vec3d(-4, 0, 2));
  key.Grasper(5.2, 0.33f, 0.50f, 3, 0.0);
  key.Grasper(5.4, 0.33f, 0.50f, 4, 50);
  key.Grasper(6.0, 0.33f, 0.50f, 20, 50);
  key.Hook(0.0, 0.58f, 0.42f, 15, 0, Vec3d(0, -50, 0));
  key.Hook(1.4, 0.58f, 0.42f, 12);
  key.Hook(2.1, 0.58f, 0.42f, 2.5);
  key.Hook(2.3, 0.58f, 0.42f, 2.5, 35);
  key.Hook(4.8, 0.58f, 0.545f, 2.5, 35);
  key.Hook(4.9, 0.58f, 0.545f, 2.5);
  key.Hook(5.4, 0.58f, 0.545f, 12);
  key.Hook(6.0, 0.58f, 0.50f, 15);
  scene.script_duration_s = 6;
  return scene;
}

}  // namespace fulcrum::scene
