// What a scene description says: plain settings with defaults. Filled by services/scene/compiler/scene_yaml.h from a
// YAML file or by the presets below, turned into a SceneData by services/scene/builder/build.h.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

/// How a brick becomes tetrahedra: six by Kuhn's split, the same in every brick, or five whose diagonals alternate from
/// brick to brick, which lock less (plain linear tetrahedra bent with nu = 0.45: 19 % off instead of 42 %).
enum class BrickSplit { kSix, kFive };

/// The procedural rectum: a walled tube along +y (cranial), z anterior, as `rings` x `segments` x 2 vertices; each of
/// the (rings - 1) * segments bricks is split into tetrahedra.
struct TubeSettings {
  int rings = 43;
  int segments = 24;
  double length_m = 0.200;
  double outer_radius_m = 0.018;
  double wall_m = 0.003;
  double sagittal_bend_m = 0.012;  ///< The ends lie this much higher than the middle.
  double lateral_bend_m = 0.004;   ///< Amplitude of the S in the frontal plane.
  int fold_count = 5;              ///< Haustra along the length.
  double fold_depth_m = 0.0012;    ///< Amplitude of the folds on the radius.
  BrickSplit split =
      BrickSplit::kSix;  ///< kFive needs an even number of segments: diagonals must agree round the ring.
};

/// The organ read from a mesh instead: its tetrahedra as they are, or a surface that is filled with tetrahedra (without
/// `wall_m` the wall is not told apart from what it holds). The membrane covers a stretch of its centre line, on the
/// side it is dissected from.
struct ImportSettings {
  double scale_m = 0.001;          ///< Metres per unit of the files.
  Vec3f origin_m = Vec3f::Zero();  ///< This place of the files becomes the origin of frame W.
  std::filesystem::path organ_file;
  bool remesh = false;        ///< Fill the surface of a file's tetrahedra anew.
  bool cap_openings = false;  ///< Close an open surface with caps.
  double wall_m = 0;          ///< > 0: hollow, a wall this thick below the surface; openings stay open.
  int target_tets = 8000;
  double tet_edge_m = 0;            ///< > 0: tetrahedra of about this mean edge instead of `target_tets`.
  double min_edge_m = 0.0003;       ///< Shorter edges of the surface are slivers and are collapsed.
  int organ_triangles_max = 14000;  ///< The embedded surface is decimated to this many triangles.
  /// The organ's centre line, caudal end first, in the frame of the files [m].
  std::vector<Vec3f> centreline_m;
  /// The stretch under the membrane, as fractions of the centre line's length; beyond it the organ is fixed.
  double from = 0.1, to = 0.9;
  Vec3f facing = Vec3f::UnitZ();  ///< The membrane's middle lies this way from the centre line.
  double sector_rad = 2.2;        ///< How far round the organ the membrane follows it.
  double flare_m = 0.010;         ///< Then it leaves the organ and goes on this far to either side.
  double bed_m = 0.025;           ///< A fixed surface continues it to the sides by so much.
  double cavity_m = 0;            ///< Radius of a wall round the stretch, seen from inside; 0: none.
  struct Surrounding {
    std::string name;
    SurfaceRole role = SurfaceRole::kOther;
    std::filesystem::path file;
    Vec3f offset_m = Vec3f::Zero();  ///< Moved by this, as the assistant retracts it.
    int triangles_max = 4000;        ///< Decimated to this many.
    bool collides = false;
  };
  std::vector<Surrounding> surroundings;
};

/// The membrane's dynamic layer. Columns run across the organ (coordinate s, +x), rows along it (coordinate t, +y).
struct MembraneSettings {
  int rows = 289;
  int cols = 64;
  double width_m = 0.069;  ///< Arc length across, procedural only.
  double gap_m = 0.0055;   ///< From the organ's surface: the fat lies between.
  double density_kg_m2 = 0.5;
  int bending_row_stride = 4;  ///< Bending acts on the sub-grid of every so many rows …
  int bending_col_stride = 7;  ///< … and columns; both divide the number of cells.
  int binding_row_stride = 4;  ///< Every so many rows and columns a node is bound to the organ …
  int binding_col_stride = 4;
  double binding_reach_m = 0.0068;  ///< … where the organ's surface is this near.
};

/// A ureter or nerve beneath the membrane, through points given as fractions of the sheet.
struct StructureSettings {
  ProtectedKind kind = ProtectedKind::kUreter;
  double radius_m = 0.0025;
  double depth_m = 0.003;
  std::vector<Vec2f> path;  ///< (s, t) fractions in [0, 1].
};

/// One key of the operator's script: a place over the membrane or in the world.
struct ScriptKeySettings {
  double time_s = 0;
  int tool = 0;
  std::optional<Vec3f> world_m;     ///< Set: this place. Not set: the three below.
  Vec2f sheet = Vec2f(0.5f, 0.5f);  ///< (s, t) fractions of the sheet in [0, 1].
  double height_m = 0;              ///< Above the sheet at rest; negative: pressed in.
  Vec3f offset_m = Vec3f::Zero();   ///< Added to it, frame W.
  double jaw_rad = 0;
  std::uint32_t pedals = kPedalNone;
  double power_W = 0;
};

/// How a tool looks, from mesh files. Their z axis runs along the shaft to the tip; jaws are closed and, after the
/// turn, their hinge is parallel to y.
struct ToolMeshSettings {
  double scale_m = 0.001;                        ///< Metres per unit of the files.
  double turn_rad = 0;                           ///< About z, from the files' frame to frame T.
  Vec3f origin_m = Vec3f::Zero();                ///< Where the files' origin lies in frame T.
  std::filesystem::path body_file;               ///< Empty: the tool is drawn by its dimensions.
  std::vector<std::filesystem::path> jaw_files;  ///< Of grasper and scissors: the one that opens towards +x, the other.
};

struct SceneSettings {
  std::string name;
  std::string description;
  PhysicsParams physics;
  ThermalParams thermal;
  RenderParams render;
  HapticsParams haptics;
  Breathing breathing;
  double organ_density_kg_m3 = 1050;
  TubeSettings tube;  ///< Used without `import`.
  std::optional<ImportSettings> import;
  MembraneSettings membrane;
  std::vector<StructureSettings> structures;
  std::array<ToolDescription, kMaxTools> tools{};
  std::array<ToolMeshSettings, kMaxTools> tool_meshes;
  std::vector<ScriptKeySettings> script;
  double script_duration_s = 20;
  AssessmentParams assessment = UsualAssessment();
  std::vector<Vec2f> planned_line;  ///< Of the assessment: (s, t) fractions in [0, 1], straight from point to point.
  std::uint32_t node_mask = 0x3e;   ///< Bit per NodeId.
};

/// A tool with the usual dimensions and its trocar at `p_WP`.
ToolDescription DefaultTool(ToolKind kind, const Vec3f& p_WP);

/// The paper's size (Table 3 within 2 %); the same as deploy/scenes/built-in.yaml.
SceneSettings BuiltIn();
/// About a tenth of it; the same as deploy/scenes/small.yaml.
SceneSettings Small();

}  // namespace fulcrum::scene
