// A compiled scene as plain data, read by solvers and nodes. The arrays are in a memory-mapped scene file
// (services/scene) or, in tests, in a SceneData on the heap. No I/O here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "services/base/core/assessment.h"
#include "services/base/core/messages.h"
#include "services/base/core/types.h"

namespace fulcrum {

// ------------------------------------------------------------------------------------------- parameters (POD)

enum class PhysicsMode : std::uint32_t { kPaper = 0, kXpbd = 1, kAccurate = 2 };

/// How the paper's equations are taken, in physics and heat: with the corrections that make them usable, or to the
/// letter, for comparison (deploy/docs/measurements/paper).
enum class PaperForm : std::uint32_t { kCorrected = 0, kPrinted = 1 };

/// What the membrane of mode accurate is (physics_node/energy/elastic_model.h). The other modes always take springs.
enum class MembraneModel : std::uint32_t { kSprings = 0, kContinuum = 1 };

/// Work of the accurate solver per step: substeps x iterations of the global solve.
enum class PhysicsPreset : std::uint32_t { kFast = 0, kDefault = 1, kAccurate = 2, kReference = 3 };

/// Section `physics` of a scene. The stiffnesses k are those of PBD, in (0, 1] per iteration, and belong to mode paper;
/// the moduli are SI, are used by the other modes, and determine the forces in all modes.
struct PhysicsParams {
  PhysicsMode mode = PhysicsMode::kPaper;
  PaperForm as = PaperForm::kCorrected;  ///< For mode paper; printed: Table 1 replaces dt_s, iterations, damping and k.
  PhysicsPreset preset = PhysicsPreset::kDefault;
  std::uint32_t substeps = 20;  ///< For mode xpbd.
  std::uint32_t iterations = 3;
  float dt_s = 0.01f;
  float damping_per_s = 3.0f;
  Vec3f gravity = Vec3f::Zero();  ///< [m/s^2]; zero in the paper preset: the rest shape is the shape under load.
  float k_stretch_tube = 0.8f;
  float k_stretch_membrane = 0.9f;
  float k_volume = 0.8f;
  float k_bending = 0.1f;
  float k_binding = 0.01f;  ///< In tension; ten times as much in compression (capped at 1).
  float tube_youngs_modulus_Pa = 1.0e5f;
  float tube_poisson = 0.45f;
  MembraneModel membrane_model = MembraneModel::kContinuum;
  float membrane_Et_N_per_m = 150.0f;   ///< Young's modulus times thickness.
  float membrane_stiffening = 0.0f;     ///< c of the J-shape: of tension E t (e + c e^3) at engineering strain e.
  float membrane_prestrain = 0.0f;      ///< Strain of the membrane in the rest shape.
  float membrane_bending_Nm = 2.0e-6f;  ///< Flexural rigidity.
  /// Young's modulus of the fat between membrane and organ, which the bindings represent.
  float fat_youngs_modulus_Pa = 3.0e3f;
  float friction = 0.2f;
  float collision_margin_m = 0.0005f;
  float grasp_radius_m = 0.004f;  ///< Particles within this distance of the jaw's centre line are held.
  float grasp_close_rad = 0.25f;  ///< The jaw grasps below this angle …
  float grasp_open_rad = 0.45f;   ///< … and opens above this one.
  float grip_force_N = 8.0f;      ///< The grasp slips above this traction.
  /// Principal stretch at which the membrane tears; 0: never. Porcine mesentery and peritoneum fail at 1.77 to 3.18;
  /// the built-in scene's script reaches 2.24 beside the jaws.
  float tear_stretch = 3.1f;
};

/// Model of thermal_node; thermal_node/DESIGN.md.
enum class ThermalModel : std::uint32_t { kAccurate = 0, kPaper = 1 };

/// Section `thermal`. Defaults: peritoneum on fat, lab values.
struct ThermalParams {
  ThermalModel model = ThermalModel::kAccurate;
  PaperForm as = PaperForm::kCorrected;  ///< For model paper; printed: Table 2 replaces the tissue's properties.
  float cell_m = 1.0e-4f;
  float thickness_m = 3.0e-4f;
  float density_kg_m3 = 1050.0f;
  float heat_capacity_J_kgK = 3400.0f;
  float conductivity_W_mK = 0.45f;
  float latent_heat_J_m3 = 1.6e9f;
  float body_temperature_C = 37.0f;
  float h_top_W_m2K = 25.0f;
  float h_below_W_m2K = 350.0f;
  float h_tented_W_m2K = 20.0f;
  float perfusion_per_s = 0.002f;
  float sigma_S_m = 0.35f;  ///< Electrical conductivity of the membrane at body temperature.
  float sigma_per_K = 0.015f;
  float sigma_fat_S_m = 0.035f;
  float fat_depth_m = 0.005f;  ///< H of the leak g = sigma_fat / H.
  float v_max_V = 350.0f;
  float i_max_A = 2.0f;
  float hook_radius_m = 0.0005f;
  float shrink_max = 0.3f;   ///< Share of the rest length lost at full collagen damage.
  std::uint32_t volume = 0;  ///< 1: heat and damage are also computed in depth; h_below_W_m2K is then not used.
};

/// Section `breathing`: periodic motion of the abdominal wall and other breathing surroundings;
/// services/base/core/breathing.h.
struct Breathing {
  Vec3f direction = Vec3f::UnitZ();  ///< Unit vector in W along which they move from their place in the scene.
  float amplitude_m = 0;             ///< Peak to peak; 0: none.
  float period_s = 4;
};

/// Section `render`.
struct RenderParams {
  std::uint32_t width = 960, height = 540;
  float rate_Hz = 15.0f;
  float png_rate_Hz = 2.0f;
  Vec3f scope_tip_W = Vec3f(0, 0, 0.2f);  ///< Laparoscope tip [m].
  Vec3f scope_target_W = Vec3f::Zero();
  float fov_deg = 60.0f;
  float scope_angle_deg = 30.0f;  ///< 0 or 30 degree optics.
  float roll_deg = 0.0f;          ///< Roll of the horizon, clockwise in the picture.
  std::uint32_t hud = 1;          ///< 0: no figures in the picture; warnings remain.
};

/// How the pictures of two eyes share one picture, each at its full field and squeezed to half of the width or height.
enum class StereoLayout : std::uint32_t {
  kNone,        ///< One camera.
  kSideBySide,  ///< Left eye on the left.
  kTopBottom    ///< Left eye on top.
};

/// Keys `stereo`, `interocular_mm` and `convergence_mm` of section `render`.
struct StereoParams {
  StereoLayout layout = StereoLayout::kNone;
  float interocular_m = 0.005f;  ///< Distance of the two eyes, which lie beside scope_tip_W.
  float convergence_m = 0;       ///< Distance of the plane without disparity; 0: that of the camera's target.
};

/// Section `haptics`.
struct HapticsParams {
  float force_limit_N = 3.3f;
  float slew_N_per_ms = 0.4f;
  float hand_mass_kg = 0.15f;
  float hand_stiffness_N_m = 400.0f;
  float hand_damping_Ns_m = 8.0f;
  float force_scale = 0.3f;  ///< Ratio of hand force to tissue force.
};

// ----------------------------------------------------------------------------------------------- elements (POD)

struct StretchConstraint {
  Index a, b;
  float rest_length;  ///< [m]
};

/// Dihedral angle at the edge (v[0], v[1]) between the wings v[2] and v[3].
struct BendingConstraint {
  std::array<Index, 4> v;
  /// Signed angle from n1 = (x1-x0)x(x2-x0) to n2 = (x3-x0)x(x1-x0) about x1-x0 [rad], 0 when flat; at rest n1 and n2
  /// point outward (away from the organ).
  float rest_angle;
};

/// Eq. 9 of the paper: a spring from a membrane node to a point of a tube surface triangle.
struct Binding {
  Index membrane;
  Triangle surface;
  std::array<float, 3> barycentric;
  float rest_length;  ///< [m]
};

/// What a solid looks like.
enum class SolidLook : std::uint32_t {
  kBowel,
  kBladder,
  kLiver,
  kGallbladder,
  kFat,
  kMuscle,
  kArtery,
  kVein,
  kUreter,
  kNerve
};
inline constexpr std::uint32_t kSolidLooks = 10;

/// One of several deformable bodies: ranges of the organ's vertices, surface_vertices and surface_triangles.
struct Solid {
  char name[32];
  SolidLook look;
  float youngs_modulus_Pa;  ///< Poisson's ratio is that of the scene.
  Index first_vertex, vertex_count;
  Index first_surface_vertex, surface_vertex_count;
  Index first_surface_triangle, surface_triangle_count;
};

/// The tissue that joins two solids: a spring from a vertex of one to a point of a surface triangle of another, without
/// force in the rest shape.
struct Attachment {
  Index vertex;
  Triangle surface;
  std::array<float, 3> barycentric;
  float stiffness_N_per_m;
  /// Zero: glued, the same stiffness in every direction. Else the two slide, and the spring acts along the normal of
  /// the surface, from its point nearest to the vertex: this unit vector in W at rest, on the outer side of `surface`.
  Vec3f normal = Vec3f::Zero();
};

/// A vertex of the high-resolution rectum surface, carried by one tetrahedron of the tube.
struct EmbeddedVertex {
  Index tetrahedron;
  std::array<float, 4> barycentric;
};

/// The dynamic layer of the sheets: node (row, col) is particle first + row * cols + col. Cell (r, c) has the triangles
/// (n00, n01, n11) and (n00, n11, n10): its diagonal is n00-n11. No rows and columns: a scene without a sheet.
struct MembraneGrid {
  Index first = 0;
  std::uint32_t rows = 0, cols = 0;
  float texel_m = 1.0e-4f;  ///< Atlas texel x = s / texel_m, y = t / texel_m.
  [[nodiscard]] Index node_count() const { return rows * cols; }
  [[nodiscard]] Index triangle_count() const { return rows && cols ? 2 * (rows - 1) * (cols - 1) : 0; }
};

/// One of several sheets: a rectangle of the grid from node (first_row, 0) on. Where no rectangle is the grid has
/// nodes, but neither edges nor cells; those nodes are fixed, at the place of the nearest node of the sheet before
/// them.
struct SheetPart {
  char name[32];
  std::uint32_t first_row, rows, cols;
  Index over;  ///< Number of the solid that it covers; kNoIndex: spanned freely, with air on both sides.
  /// Of its own [N/m], [N m], [Pa], stretch; 0: the value of PhysicsParams.
  float Et_N_per_m = 0, bending_Nm = 0, fat_youngs_modulus_Pa = 0, tear_stretch = 0;
  /// Of its own [m], [W/mK], [S/m]; 0: the value of ThermalParams.
  float thickness_m = 0, conductivity_W_mK = 0, sigma_S_m = 0;
};

enum class SurfaceRole : std::uint32_t { kAbdominalWall, kRetroperitoneum, kPelvis, kBladder, kOther };

/// A fixed surrounding surface: ranges of static_vertices and static_triangles (indices into static_vertices).
struct StaticSurface {
  char name[32];
  SurfaceRole role;
  Index first_vertex, vertex_count;
  Index first_triangle, triangle_count;
  std::uint32_t collides;
};

enum class ProtectedKind : std::uint32_t { kUreter, kNerve };

/// A tube under the membrane: polyline of protected_points in frame W and its place on the membrane.
struct ProtectedStructure {
  ProtectedKind kind;
  float radius_m;
  float depth_m;  ///< Depth below the membrane.
  Index first_point, point_count;
};
struct ProtectedPoint {
  Vec3f p_W;
  Vec2f material;  ///< (s, t) [m].
};

struct ToolDescription {
  ToolKind kind = ToolKind::kNone;
  Vec3f p_WP = Vec3f::Zero();  ///< Trocar pivot (the fulcrum) [m].
  float shaft_radius_m = 0;
  float shaft_length_m = 0;
  float tip_radius_m = 0;  ///< Radius of the capsule that touches tissue.
  float tip_length_m = 0;  ///< Length of the jaws, or of the hook's foot.
  /// An assistant: no person operates this tool, and its scripted hand keeps this force of the tissue while its jaws
  /// are closed [N]. 0: none.
  float traction_N = 0;

  [[nodiscard]] bool assists() const { return traction_N > 0; }
};

/// The first tool of a kind.
[[nodiscard]] inline std::optional<std::size_t> FindTool(std::span<const ToolDescription> tools, ToolKind kind) {
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (tools[i].kind == kind) return i;
  }
  return std::nullopt;
}

/// Part of an instrument that a mesh represents: everything that does not turn, or the jaw that opens towards +x or -x.
enum class ToolPart : std::uint32_t { kBody, kJawPlus, kJawMinus };

/// A part of a tool's mesh: ranges of tool_vertices and tool_triangles (indices into tool_vertices). Vertices in frame
/// T, jaws closed; a jaw turns about the y axis through (0, 0, -tip_length_m).
struct ToolMesh {
  std::uint32_t tool;
  ToolPart part;
  Index first_vertex, vertex_count;
  Index first_triangle, triangle_count;
};

/// One key of the scripted operator; linear in time between keys with smooth ends.
struct ScriptKey {
  float time_s;
  std::uint32_t tool;
  Vec3f p_W;  ///< Target position of the tip [m].
  float jaw_rad;
  std::uint32_t pedals;  ///< PedalBits, valid from this key to the tool's next one.
  float power_W;
  float roll_rad = 0;  ///< Rotation about the shaft, clockwise as seen from the handle.
};

// --------------------------------------------------------------------------------------------------- the scene

/// The membrane in its own coordinates, the tissue below it and the heat sources: everything that the solvers of heat,
/// damage and topology read.
struct SheetScene {
  char name[64] = {};
  std::uint64_t hash = 0;
  ThermalParams thermal;

  MembraneGrid membrane;
  std::span<const Vec3f> rest_position;         ///< [n] of all particles, frame W, m; the membrane's from `first` on.
  std::span<const float> membrane_rest_length;  ///< [3 * rows * cols]; 0 where the grid has no such edge.
  /// [rows * cols] (s, t) of each node in the atlas, m: on its flattened sheet, of which each has a place of its own.
  std::span<const Vec2f> membrane_material;
  std::span<const SheetPart> sheets;  ///< Ordered by row; empty: the whole grid is one sheet.

  std::span<const ProtectedStructure> protected_structures;
  std::span<const ProtectedPoint> protected_points;
};

/// The deformable tissue, its surroundings and the instruments: everything that the solvers of the tissue read.
/// Particles: tube vertices [0, tube_vertex_count), then the membrane grid.
///
/// Constraints are sorted by colour: colour k is [offset[k], offset[k+1]); no two constraints of a colour share a
/// particle, so a colour can be solved in any order with the same result.
struct TissueScene : SheetScene {
  PhysicsParams physics;
  Breathing breathing;

  Index tube_vertex_count = 0;
  std::span<const float> inverse_mass;  ///< [n] 1/kg; 0 = fixed.
  std::span<const Tetrahedron> tets;    ///< Tube; positive volume.
  std::span<const Index> tet_colours;
  std::span<const StretchConstraint> tube_edges;
  std::span<const Index> tube_edge_colours;
  std::span<const BendingConstraint> bending;
  std::span<const Index> bending_colours;
  std::span<const Binding> bindings;
  std::span<const Index> binding_colours;
  std::span<const Triangle> tube_surface;  ///< Outer surface of the tets, outward.
  /// In order of their vertices, of which each belongs to one solid. Empty: all is one organ, with the modulus of
  /// `physics`.
  std::span<const Solid> solids;
  std::span<const Attachment> attachments;  ///< Of mode accurate.

  std::span<const StaticSurface> static_surfaces;
  std::span<const Vec3f> static_vertices;
  std::span<const Triangle> static_triangles;

  std::array<ToolDescription, kMaxTools> tools{};
};

/// The whole scene, as nodes read it. A solver takes the slice that it needs.
struct SceneView : TissueScene {
  RenderParams render;
  StereoParams stereo;
  HapticsParams haptics;
  AssessmentParams assessment = UsualAssessment();

  std::span<const EmbeddedVertex> surface_vertices;  ///< High-resolution rectum surface.
  std::span<const Triangle> surface_triangles;

  std::span<const ToolMesh> tool_meshes;  ///< Meshes for the picture; a tool without one is drawn from its dimensions.
  std::span<const Vec3f> tool_vertices;
  std::span<const Triangle> tool_triangles;
  std::span<const ScriptKey> script;  ///< Sorted by tool, then time.
  float script_duration_s = 0;
  std::span<const Vec2f> planned_line;  ///< For the assessment: (s, t) on the flattened membrane, m; empty: none.

  /// Bit per NodeId: the nodes that the supervisor starts for this scene.
  std::uint32_t node_mask = 0x3e;
};

}  // namespace fulcrum
