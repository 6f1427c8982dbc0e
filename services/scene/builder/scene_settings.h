// Content of a scene description: plain settings with defaults. Filled by services/scene/compiler/scene_yaml.h from a
// YAML file or by the presets below, and built into a SceneData by services/scene/builder/build.h.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/base/core/sheet_heat.h"
#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"
#include "services/scene/builder/operator_hand.h"

namespace fulcrum::scene {

/// Split of a brick into tetrahedra: six by Kuhn's split, the same in every brick, or five whose diagonals alternate
/// from brick to brick, which lock less (plain linear tetrahedra bent with nu = 0.45: 19 % off instead of 42 %).
enum class BrickSplit { kSix, kFive };

/// The procedural rectum: a walled tube along +y (cranial), z anterior, as `rings` x `segments` x 2 vertices; each of
/// the (rings - 1) * segments bricks is split into tetrahedra.
struct TubeSettings {
  int rings = 43;
  int segments = 24;
  double length_m = 0.200;
  double outer_radius_m = 0.018;
  double wall_m = 0.003;
  double sagittal_bend_m = 0.012;  ///< Height of the ends above the middle.
  double lateral_bend_m = 0.004;   ///< Amplitude of the S in the frontal plane.
  int fold_count = 5;              ///< Haustra along the length.
  double fold_depth_m = 0.0012;    ///< Amplitude of the folds on the radius.
  /// kFive needs an even number of segments, because the diagonals must agree around the ring.
  BrickSplit split = BrickSplit::kSix;
};

inline constexpr int kMostSurroundings = 16;        ///< Of an imported organ, and as many fixed surfaces.
inline constexpr int kMostBodies = kMaxSolids - 1;  ///< Beside the organ.

/// A body of simple shape: an ellipsoid, or what a circle sweeps along a smooth curve, rounded at both ends.
struct ShapeSettings {
  std::optional<Vec3f> radii_m;    ///< Semi-axes of an ellipsoid; not set: swept.
  Vec3f at_m = Vec3f::Zero();      ///< Middle of the ellipsoid.
  Vec3f turn_rad = Vec3f::Zero();  ///< Of the ellipsoid, about x, then y, then z.
  std::vector<Vec3f> line_m;       ///< Points of the curve.
  std::vector<double> radius_m;    ///< At each of them.
};

/// Of a body that is filled: a scene's vertices (kMaxTissueVertices) have some five tetrahedra each.
inline constexpr int kMostTets = 1000000;

/// A surface that does not deform, in the frame in which the organ is described.
struct FixedSettings {
  std::string name;
  SurfaceRole role = SurfaceRole::kOther;
  std::filesystem::path file;  ///< From the origin of `import`; empty: `shape`.
  double scale_m = 0;          ///< Metres per unit of the file; 0: as of `import`.
  ShapeSettings shape;
  bool inside = false;             ///< Turned over: a closed surface is seen from inside.
  Vec3f offset_m = Vec3f::Zero();  ///< Displacement, as by the assistant's retraction.
  int triangles_max = 4000;        ///< The surface is decimated to this many triangles.
  bool collides = false;
};

/// The organ read from a mesh: its tetrahedra unchanged, or a surface that is filled with tetrahedra (without `wall_m`
/// wall and lumen are one body). The membrane covers a stretch of the organ's centre line, on the side from which it is
/// dissected, or a patch of its surface. Without `centreline_m` the importer finds line or patch, and the middle of the
/// membrane becomes the origin of frame W.
struct ImportSettings {
  double scale_m = 0.001;            ///< Metres per unit of the files.
  Vec3f origin_m = Vec3f::Zero();    ///< Point in the frame of the files that becomes the origin of frame W.
  std::filesystem::path organ_file;  ///< Empty: `shape`.
  ShapeSettings shape;
  bool remesh = false;        ///< Fill the surface of a file's tetrahedra with new ones.
  bool cap_openings = false;  ///< Close an open surface with caps.
  double wall_m = 0;          ///< > 0: hollow, with a wall of this thickness below the surface; openings stay open.
  int target_tets = 8000;
  double tet_edge_m = 0;            ///< > 0: tetrahedra of about this mean edge instead of `target_tets`.
  double min_edge_m = 0.0003;       ///< Shorter edges of the surface are slivers and are collapsed.
  int organ_triangles_max = 14000;  ///< The embedded surface is decimated to this many triangles.
  /// The organ's centre line, caudal end first, in the frame of the files [m]; empty: found.
  std::vector<Vec3f> centreline_m;
  bool patch = false;                            ///< The membrane covers a patch, whether or not the organ is a tube.
  std::optional<Vec3f> patch_at_m;               ///< Its middle, in the frame of the files; none: found.
  double patch_width_m = 0, patch_length_m = 0;  ///< 0: most of the organ as seen from outside.
  double held_share = 0.35;  ///< Under a patch the organ is fixed on its far side, over this share of its height.
  /// The stretch under the membrane, as fractions of the centre line's length; beyond it the organ is fixed.
  double from = 0.1, to = 0.9;
  /// Direction from the organ to the middle of the membrane, in the frame of the files; none: found, or z with a given
  /// centre line.
  std::optional<Vec3f> facing;
  double sector_rad = 2.2;  ///< Angle around the organ over which the membrane follows it.
  double flare_m = 0.010;   ///< Length by which the membrane then continues away from the organ on either side.
  double bed_m = 0.025;     ///< Length of a fixed surface that continues it on either side.
  double cavity_m = 0;      ///< Radius of a wall around the stretch, seen from inside; 0: none.
  std::vector<FixedSettings> surroundings;  ///< Files only.
};

/// What a body is made of.
struct Material {
  SolidLook look = SolidLook::kBowel;
  double youngs_modulus_Pa = 1e5;
  double density_kg_m3 = 1050;
};

/// A further deformable body, in the frame in which the organ is described: that of the files of `import`, else W.
struct BodySettings {
  std::string name;
  Material material;
  std::filesystem::path file;  ///< Surface or tetrahedra, from the origin of `import`; empty: `shape`.
  double scale_m = 0;          ///< Metres per unit of the file; 0: as of `import`.
  bool cap_openings = false;   ///< Close an open surface of the file with caps.
  Vec3f offset_m = Vec3f::Zero();
  ShapeSettings shape;
  bool is_tube = false;       ///< `shape` is swept and thin: hexagonal rings around its line.
  double tet_edge_m = 0.006;  ///< Mean edge of the tetrahedra; of a tube, distance of the rings.
  int surface_triangles_max = 4000;
  /// Fixed on this side over this share of its extent; none: not fixed by itself.
  std::optional<Vec3f> held_side;
  double held_share = 0.35;
  bool first_end_held = false, last_end_held = false;  ///< Of a tube.
};

enum class AttachKind { kGlued, kSliding };

/// Where two bodies are nearer than `reach_m` they are joined by tissue.
struct AttachSettings {
  std::string from, to;  ///< Names of bodies; `organ` is the one under the membrane.
  double reach_m = 0.004;
  double youngs_modulus_Pa = 3e3;
  AttachKind kind = AttachKind::kGlued;
  /// Names of regions: only what is in them is joined; empty: anywhere.
  std::string from_region = {}, to_region = {};
};

/// A named part of space, in the frame of the bodies: a box or an ellipsoid.
struct RegionSettings {
  std::string name;
  bool is_box = false;
  Vec3f half_m = Vec3f::Zero();    ///< Half of each side, or the semi-axes.
  Vec3f at_m = Vec3f::Zero();      ///< Middle.
  Vec3f turn_rad = Vec3f::Zero();  ///< About x, then y, then z.
};

/// The membrane's dynamic layer. Columns run across the organ (coordinate s, +x), rows along it (coordinate t, +y).
struct MembraneSettings {
  int rows = 289;
  int cols = 64;
  double width_m = 0.069;  ///< Arc length across, procedural only.
  double gap_m = 0.0055;   ///< Distance from the organ's surface, filled with fat.
  double density_kg_m2 = 0.5;
  int bending_row_stride = 4;  ///< Bending acts on a sub-grid of every so many rows …
  int bending_col_stride = 7;  ///< … and columns; both divide the number of cells.
  int binding_row_stride = 4;  ///< Nodes of every so many rows and columns are bound to the organ …
  int binding_col_stride = 4;
  double binding_reach_m = 0.0068;  ///< … where its surface is at most this far away.
};

/// A further sheet, in the frame of the bodies: over a patch of one, or spanned between two lines.
struct SheetSettings {
  std::string name;
  MembraneSettings grid;  ///< Of it: all but `width_m`.
  std::string over;       ///< A body; empty: spanned.
  std::optional<Vec3f> at_m, facing;
  double width_m = 0, length_m = 0;             ///< Of the patch; 0: most of the body as seen from outside.
  std::array<std::vector<Vec3f>, 2> between_m;  ///< Points of the lines of the first and the last row.
  bool ends_held = true, sides_held = true;     ///< The first and the last row, the first and the last column.
  SheetProperties own{};                        ///< 0: that of the scene.
  SheetHeat heat = {};                          ///< Likewise.
};

/// A ureter or nerve below the membrane, through points given as fractions of the sheet.
struct StructureSettings {
  ProtectedKind kind = ProtectedKind::kUreter;
  double radius_m = 0.0025;
  double depth_m = 0.003;
  std::vector<Vec2f> path;  ///< (s, t) fractions in [0, 1].
};

/// One key of the operator's script, placed over the membrane or in the world.
struct ScriptKeySettings {
  double time_s = 0;
  int tool = 0;
  std::optional<Vec3f> world_m;     ///< Set: position in W. Not set: a place on the sheet `on`, by the next three.
  Vec2f sheet = Vec2f(0.5f, 0.5f);  ///< (s, t) fractions of the sheet in [0, 1].
  double height_m = 0;              ///< Height above the sheet at rest; negative: pressed in.
  Vec3f offset_m = Vec3f::Zero();   ///< Offset in W, added to the point on the sheet.
  double jaw_rad = 0;
  std::uint32_t pedals = kPedalNone;
  double power_W = 0;
  double roll_rad = 0;
  std::string on = {};  ///< Name of the sheet; empty: the first one.
};

/// Appearance of a tool, from mesh files. The z axis of the files runs along the shaft to the tip; jaws are closed and,
/// after the turn, their hinge is parallel to y.
struct ToolMeshSettings {
  double scale_m = 0.001;           ///< Metres per unit of the files.
  double turn_rad = 0;              ///< Rotation about z, from the files' frame to frame T.
  Vec3f origin_m = Vec3f::Zero();   ///< Position of the files' origin in frame T.
  std::filesystem::path body_file;  ///< Empty: the tool is drawn from its dimensions.
  /// For grasper and scissors: the jaw that opens towards +x, then the other.
  std::vector<std::filesystem::path> jaw_files;
};

struct SceneSettings {
  std::string name;
  std::string description;
  PhysicsParams physics;
  ThermalParams thermal;
  RenderParams render;
  StereoParams stereo;
  HapticsParams haptics;
  Breathing breathing;
  double organ_density_kg_m3 = 1050;
  SolidLook organ_look = SolidLook::kBowel;
  bool has_organ = true;  ///< And a membrane over it.
  TubeSettings tube;      ///< Used without `import`.
  std::optional<ImportSettings> import;
  std::vector<BodySettings> bodies;
  std::vector<FixedSettings> fixed;
  std::vector<AttachSettings> attach;
  std::vector<RegionSettings> regions;
  MembraneSettings membrane;
  std::vector<SheetSettings> sheets;
  std::vector<StructureSettings> structures;
  std::array<ToolDescription, kMaxTools> tools{};
  std::array<ToolMeshSettings, kMaxTools> tool_meshes;
  std::vector<ScriptKeySettings> script;
  double script_duration_s = 20;
  std::optional<OperatorHand> hand;  ///< Performs the script; none: exactly.
  AssessmentParams assessment = UsualAssessment();
  std::vector<Vec2f> planned_line;  ///< For the assessment: (s, t) fractions in [0, 1], straight from point to point.
  std::uint32_t node_mask = 0x3e;   ///< Bit per NodeId.
  /// More vertices are built than a frame on the bus can hold, for studies of the mesh without a session.
  bool any_size = false;
};

/// A tool with the usual dimensions and its trocar at `p_WP`.
ToolDescription DefaultTool(ToolKind kind, const Vec3f& p_WP);

/// Scene of the paper's size (Table 3 within 2 %); the same as deploy/scenes/built-in.yaml.
SceneSettings BuiltIn();
/// Scene of about a tenth of that size; the same as deploy/scenes/small.yaml.
SceneSettings Small();

}  // namespace fulcrum::scene
