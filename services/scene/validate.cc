#include "services/scene/validate.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <vector>

#include "services/scene/colouring.h"

namespace fulcrum::scene {
namespace {

constexpr float kFarthest_m = 10.0f;            ///< Nothing of a scene lies this far from the origin.
constexpr float kWeightSumTolerance = 1.0e-4f;  ///< Float rounding of weights of magnitude up to kLargestWeight.
constexpr float kLargestWeight = 20.0f;         ///< More is extrapolation far outside a tetrahedron.

/// Thrown inside this file only: leaves the nested loops at the first fault.
struct Fault {
  SceneFault what;
};

template <class... Parts>
[[noreturn]] void Fail(const char* section, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  throw Fault{{section, text.str()}};
}

void CheckRange(const char* section, const char* what, std::size_t element, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    Fail(section, "element ", element, ": ", what, " = ", value, "; valid: ", low, " to ", high);
  }
}

void CheckIndex(const char* section, std::size_t element, std::uint64_t index, std::uint64_t first, std::uint64_t end) {
  if (index < first || index >= end) {
    Fail(section, "element ", element, ": index ", index, "; valid: ", first, " to below ", end);
  }
}

template <class Indices>
void CheckDistinct(const char* section, std::size_t element, const Indices& indices) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    for (std::size_t j = i + 1; j < indices.size(); ++j) {
      if (indices[i] == indices[j]) {
        Fail(section, "element ", element, ": index ", indices[i], " twice");
      }
    }
  }
}

void CheckSize(const char* section, std::size_t size, std::size_t wanted) {
  if (size != wanted) {
    Fail(section, size, " elements; valid: ", wanted);
  }
}

template <std::size_t N>
void CheckWeights(const char* section, std::size_t element, const std::array<float, N>& weights) {
  float sum = 0;
  for (const float w : weights) {
    CheckRange(section, "weight", element, w, -kLargestWeight, kLargestWeight);
    sum += w;
  }
  if (std::abs(sum - 1) > kWeightSumTolerance) {
    Fail(section, "element ", element, ": weights sum to ", sum, "; valid: 1");
  }
}

void CheckPoint(const char* section, std::size_t element, const Vec3f& p) {
  for (int k = 0; k < 3; ++k) {
    CheckRange(section, "coordinate", element, p[k], -kFarthest_m, kFarthest_m);
  }
}

template <class Constraint>
void CheckColours(const char* section, std::span<const Index> offsets, std::span<const Constraint> constraints,
                  std::size_t particle_count) {
  if (offsets.empty() || offsets.front() != 0 || offsets.back() != constraints.size()) {
    Fail(section, "the offsets must begin with 0 and end with ", constraints.size());
  }
  std::vector<std::size_t> last_colour(particle_count, 0);
  for (std::size_t k = 0; k + 1 < offsets.size(); ++k) {
    if (offsets[k] > offsets[k + 1] || offsets[k + 1] > constraints.size()) {
      Fail(section, "element ", k + 1, ": offsets must grow and stay below ", constraints.size());
    }
    for (Index i = offsets[k]; i < offsets[k + 1]; ++i) {
      for (const Index p : ParticlesOf(constraints[i])) {
        if (last_colour[p] == k + 1) {
          Fail(section, "colour ", k, ": two constraints share particle ", p);
        }
        last_colour[p] = k + 1;
      }
    }
  }
}

// ---------------------------------------------------------------------------------------------------- parameters

struct Bound {
  const char* name;
  float value, low, high;
};

void CheckBounds(std::initializer_list<Bound> bounds) {
  for (const Bound& b : bounds) {
    if (!(b.value >= b.low && b.value <= b.high)) {
      Fail("scene", b.name, " = ", b.value, "; valid: ", b.low, " to ", b.high);
    }
  }
}

void CheckParameters(const SceneView& s) {
  const PhysicsParams& p = s.physics;
  const ThermalParams& t = s.thermal;
  const RenderParams& r = s.render;
  const HapticsParams& h = s.haptics;
  if (p.mode > PhysicsMode::kAccurate) {
    Fail("scene", "physics.mode = ", static_cast<std::uint32_t>(p.mode), "; valid: 0 (paper), 1 (xpbd), 2 (accurate)");
  }
  if (p.preset > PhysicsPreset::kReference) {
    Fail("scene", "physics.preset = ", static_cast<std::uint32_t>(p.preset), "; valid: 0 (fast) to 3 (reference)");
  }
  CheckBounds({{"physics.iterations", static_cast<float>(p.iterations), 1, 1000},
               {"physics.dt_s", p.dt_s, 1e-4f, 0.1f},
               {"physics.damping_per_s", p.damping_per_s, 0, 1000},
               {"physics.gravity", p.gravity.norm(), 0, 100},
               {"physics.k_stretch_tube", p.k_stretch_tube, 0, 1},
               {"physics.k_stretch_membrane", p.k_stretch_membrane, 0, 1},
               {"physics.k_volume", p.k_volume, 0, 1},
               {"physics.k_bending", p.k_bending, 0, 1},
               {"physics.k_binding", p.k_binding, 0, 1},
               {"physics.tube_youngs_modulus", p.tube_youngs_modulus_Pa, 1, 1e9f},
               {"physics.substeps", static_cast<float>(p.substeps), 1, 1000},
               {"physics.tube_poisson", p.tube_poisson, 0, 0.495f},
               {"physics.membrane_Et", p.membrane_Et_N_per_m, 1e-3f, 1e7f},
               {"physics.membrane_stiffening", p.membrane_stiffening, 0, 1000},
               {"physics.membrane_prestrain", p.membrane_prestrain, 0, 0.5f},
               {"physics.membrane_bending", p.membrane_bending_Nm, 0, 1},
               {"physics.fat_youngs_modulus", p.fat_youngs_modulus_Pa, 1, 1e9f},
               {"physics.friction", p.friction, 0, 2},
               {"physics.collision_margin", p.collision_margin_m, 0, 0.01f},
               {"physics.grasp_radius", p.grasp_radius_m, 1e-4f, 0.05f},
               {"physics.grasp_close", p.grasp_close_rad, 0, 1.5f},
               {"physics.grasp_open", p.grasp_open_rad, p.grasp_close_rad, 1.6f},
               {"physics.grip_force", p.grip_force_N, 0, 1000}});
  if (t.model > ThermalModel::kPaper) {
    Fail("scene", "thermal.model = ", static_cast<std::uint32_t>(t.model), "; valid: 0 (accurate), 1 (paper)");
  }
  CheckBounds({{"thermal.cell", t.cell_m, 1e-5f, 0.01f},
               {"thermal.thickness", t.thickness_m, 1e-5f, 0.01f},
               {"thermal.density", t.density_kg_m3, 1, 1e5f},
               {"thermal.heat_capacity", t.heat_capacity_J_kgK, 1, 1e5f},
               {"thermal.conductivity", t.conductivity_W_mK, 0, 1e4f},
               {"thermal.latent_heat", t.latent_heat_J_m3, 0, 1e11f},
               {"thermal.body_temperature", t.body_temperature_C, 0, 60},
               {"thermal.h_top", t.h_top_W_m2K, 0, 1e5f},
               {"thermal.h_below", t.h_below_W_m2K, 0, 1e5f},
               {"thermal.h_tented", t.h_tented_W_m2K, 0, 1e5f},
               {"thermal.perfusion", t.perfusion_per_s, 0, 10},
               {"thermal.sigma", t.sigma_S_m, 1e-4f, 100},
               {"thermal.sigma_per_K", t.sigma_per_K, 0, 1},
               {"thermal.sigma_fat", t.sigma_fat_S_m, 0, 100},
               {"thermal.fat_depth", t.fat_depth_m, 1e-4f, 1},
               {"thermal.v_max", t.v_max_V, 1, 1e4f},
               {"thermal.i_max", t.i_max_A, 1e-3f, 100},
               {"thermal.hook_radius", t.hook_radius_m, 1e-5f, 0.01f},
               {"thermal.shrink_max", t.shrink_max, 0, 0.5f},
               {"thermal.volume", static_cast<float>(t.volume), 0, 1}});
  CheckBounds({{"render.width", static_cast<float>(r.width), 16, 7680},
               {"render.height", static_cast<float>(r.height), 16, 4320},
               {"render.rate", r.rate_Hz, 0.1f, 240},
               {"render.png_rate", r.png_rate_Hz, 0, 240},
               {"render.fov", r.fov_deg, 10, 150},
               {"render.scope_angle", r.scope_angle_deg, 0, 90},
               {"render.roll", r.roll_deg, -180, 180},
               {"render.hud", static_cast<float>(r.hud), 0, 1},
               {"haptics.force_limit", h.force_limit_N, 0.01f, 100},
               {"haptics.slew", h.slew_N_per_ms, 1e-4f, 100},
               {"haptics.hand_mass", h.hand_mass_kg, 1e-3f, 100},
               {"haptics.hand_stiffness", h.hand_stiffness_N_m, 0, 1e5f},
               {"haptics.hand_damping", h.hand_damping_Ns_m, 0, 1e4f},
               {"haptics.force_scale", h.force_scale, 0, 100},
               {"breathing.direction", s.breathing.direction.norm(), 0.999f, 1.001f},
               {"breathing.amplitude", s.breathing.amplitude_m, 0, 0.05f},
               {"breathing.period", s.breathing.period_s, 0.5f, 60},
               {"script duration", s.script_duration_s, 0, 86400},
               {"membrane texel", s.membrane.texel_m, 1e-6f, 0.01f}});
  CheckPoint("scene", 0, r.scope_tip_W);
  CheckPoint("scene", 1, r.scope_target_W);
  for (std::size_t i = 0; i < s.tools.size(); ++i) {
    const ToolDescription& tool = s.tools[i];
    if (tool.kind > ToolKind::kScissors) {
      Fail("scene", "tool ", i, ": unknown kind ", static_cast<int>(tool.kind));
    }
    CheckPoint("scene", i, tool.p_WP);
    CheckRange("scene", "shaft_radius_m", i, tool.shaft_radius_m, 0, 0.05);
    CheckRange("scene", "shaft_length_m", i, tool.shaft_length_m, 0, 2);
    CheckRange("scene", "tip_radius_m", i, tool.tip_radius_m, 0, 0.05);
    CheckRange("scene", "tip_length_m", i, tool.tip_length_m, 0, 0.5);
  }
  if (s.node_mask >> kNodeCount != 0) {
    Fail("scene", "node_mask = ", s.node_mask, ": only ", kNodeCount, " nodes exist");
  }
  if (std::memchr(s.name, 0, sizeof(s.name)) == nullptr || s.name[0] == 0) {
    Fail("scene", "the name is empty or too long");
  }
}

// -------------------------------------------------------------------------------------------------------- arrays

/// No triangle of the membrane is turned over in the atlas: two places of the sheet would share a texel.
void CheckAtlas(const SceneView& s) {
  const std::size_t rows = s.membrane.rows, cols = s.membrane.cols;
  for (std::size_t r = 0; r + 1 < rows; ++r) {
    for (std::size_t c = 0; c + 1 < cols; ++c) {
      const std::size_t n = r * cols + c;
      for (const auto& [b, d] : {std::pair{n + 1, n + cols + 1}, std::pair{n + cols + 1, n + cols}}) {
        const Vec2f u = s.membrane_material[b] - s.membrane_material[n];
        const Vec2f v = s.membrane_material[d] - s.membrane_material[n];
        if (!(u.x() * v.y() - u.y() * v.x() > 0)) {
          Fail("membrane_material", "row ", r, ", column ", c, ": the sheet is folded over in the atlas");
        }
      }
    }
  }
}

void CheckParticles(const SceneView& s) {
  const std::uint64_t nodes = static_cast<std::uint64_t>(s.membrane.rows) * s.membrane.cols;
  const std::uint64_t total = s.tube_vertex_count + nodes;
  if (s.membrane.rows < 2 || s.membrane.cols < 2 || nodes > kMaxMembraneNodes || total > kMaxTissueVertices) {
    Fail("scene", s.tube_vertex_count, " organ vertices and ", s.membrane.rows, " x ", s.membrane.cols,
         " membrane nodes; valid: at least 2 x 2, at most ", kMaxMembraneNodes, " nodes and ", kMaxTissueVertices,
         " vertices");
  }
  if (s.membrane.first != s.tube_vertex_count) {
    Fail("scene", "the membrane begins at particle ", s.membrane.first, "; valid: ", s.tube_vertex_count);
  }
  CheckSize("rest_position", s.rest_position.size(), total);
  CheckSize("inverse_mass", s.inverse_mass.size(), total);
  for (std::size_t i = 0; i < total; ++i) {
    CheckPoint("rest_position", i, s.rest_position[i]);
    CheckRange("inverse_mass", "inverse mass", i, s.inverse_mass[i], 0, 1e12);
  }
  CheckSize("membrane_material", s.membrane_material.size(), nodes);
  const double atlas = static_cast<double>(s.membrane.texel_m) * kAtlasTexels;
  for (std::size_t i = 0; i < nodes; ++i) {
    CheckRange("membrane_material", "s", i, s.membrane_material[i].x(), 0, atlas);
    CheckRange("membrane_material", "t", i, s.membrane_material[i].y(), 0, atlas);
  }
  CheckAtlas(s);
}

void CheckConstraints(const SceneView& s) {
  const std::uint64_t total = s.rest_position.size(), tube = s.tube_vertex_count;
  for (std::size_t i = 0; i < s.tets.size(); ++i) {
    const Tetrahedron& t = s.tets[i];
    for (const Index v : t) {
      CheckIndex("tets", i, v, 0, tube);
    }
    const Vec3d a = s.rest_position[t[0]].cast<double>();
    const auto edge = [&](int k) { return Vec3d(s.rest_position[t[k]].cast<double>() - a); };
    if (!(edge(1).cross(edge(2)).dot(edge(3)) > 0)) {
      Fail("tets", "element ", i, ": no positive volume");
    }
  }
  CheckColours("tet_colours", s.tet_colours, s.tets, total);
  for (std::size_t i = 0; i < s.tube_edges.size(); ++i) {
    const StretchConstraint& e = s.tube_edges[i];
    CheckIndex("tube_edges", i, e.a, 0, tube);
    CheckIndex("tube_edges", i, e.b, 0, tube);
    CheckDistinct("tube_edges", i, ParticlesOf(e));
    CheckRange("tube_edges", "rest length", i, e.rest_length, 1e-7, kFarthest_m);
  }
  CheckColours("tube_edge_colours", s.tube_edge_colours, s.tube_edges, total);
  const std::size_t rows = s.membrane.rows, cols = s.membrane.cols;
  CheckSize("membrane_rest_length", s.membrane_rest_length.size(), 3 * rows * cols);
  for (std::size_t i = 0; i < s.membrane_rest_length.size(); ++i) {
    const std::size_t r = i / 3 / cols, c = i / 3 % cols, k = i % 3;
    const bool exists = (k == 0 || r + 1 < rows) && (k == 1 || c + 1 < cols);
    CheckRange("membrane_rest_length", "rest length", i, s.membrane_rest_length[i], exists ? 1e-7 : 0,
               exists ? kFarthest_m : 0);
  }
  for (std::size_t i = 0; i < s.bending.size(); ++i) {
    for (const Index v : s.bending[i].v) {
      CheckIndex("bending", i, v, tube, total);
    }
    CheckDistinct("bending", i, s.bending[i].v);
    CheckRange("bending", "rest angle", i, s.bending[i].rest_angle, -3.15, 3.15);
  }
  CheckColours("bending_colours", s.bending_colours, s.bending, total);
  for (std::size_t i = 0; i < s.bindings.size(); ++i) {
    const Binding& b = s.bindings[i];
    CheckIndex("bindings", i, b.membrane, tube, total);
    for (const Index v : b.surface) {
      CheckIndex("bindings", i, v, 0, tube);
    }
    CheckDistinct("bindings", i, b.surface);
    CheckWeights("bindings", i, b.barycentric);
    CheckRange("bindings", "rest length", i, b.rest_length, 0, kFarthest_m);
  }
  CheckColours("binding_colours", s.binding_colours, s.bindings, total);
}

/// A mesh that is a range of shared vertices and triangles.
template <class Mesh>
void CheckRanges(const char* section, std::size_t element, const Mesh& mesh, std::span<const Vec3f> vertices,
                 const char* triangle_section, std::span<const Triangle> triangles) {
  const std::uint64_t vertex_end = static_cast<std::uint64_t>(mesh.first_vertex) + mesh.vertex_count;
  const std::uint64_t triangle_end = static_cast<std::uint64_t>(mesh.first_triangle) + mesh.triangle_count;
  if (vertex_end > vertices.size() || triangle_end > triangles.size()) {
    Fail(section, "element ", element, ": reaches beyond the vertices or triangles");
  }
  for (std::uint64_t k = mesh.first_triangle; k < triangle_end; ++k) {
    for (const Index v : triangles[k]) {
      CheckIndex(triangle_section, k, v, mesh.first_vertex, vertex_end);
    }
  }
}

void CheckSurfaces(const SceneView& s) {
  for (std::size_t i = 0; i < s.tube_surface.size(); ++i) {
    for (const Index v : s.tube_surface[i]) {
      CheckIndex("tube_surface", i, v, 0, s.tube_vertex_count);
    }
    CheckDistinct("tube_surface", i, s.tube_surface[i]);
  }
  for (std::size_t i = 0; i < s.surface_vertices.size(); ++i) {
    CheckIndex("surface_vertices", i, s.surface_vertices[i].tetrahedron, 0, s.tets.size());
    CheckWeights("surface_vertices", i, s.surface_vertices[i].barycentric);
  }
  for (std::size_t i = 0; i < s.surface_triangles.size(); ++i) {
    for (const Index v : s.surface_triangles[i]) {
      CheckIndex("surface_triangles", i, v, 0, s.surface_vertices.size());
    }
  }
  for (std::size_t i = 0; i < s.static_vertices.size(); ++i) {
    CheckPoint("static_vertices", i, s.static_vertices[i]);
  }
  for (std::size_t i = 0; i < s.static_surfaces.size(); ++i) {
    const StaticSurface& f = s.static_surfaces[i];
    CheckRanges("static_surfaces", i, f, s.static_vertices, "static_triangles", s.static_triangles);
    if (std::memchr(f.name, 0, sizeof(f.name)) == nullptr || f.role > SurfaceRole::kOther || f.collides > 1) {
      Fail("static_surfaces", "element ", i, ": bad name, role or flag");
    }
  }
  for (std::size_t i = 0; i < s.static_triangles.size(); ++i) {
    for (const Index v : s.static_triangles[i]) {
      CheckIndex("static_triangles", i, v, 0, s.static_vertices.size());
    }
  }
}

void CheckToolMeshes(const SceneView& s) {
  for (std::size_t i = 0; i < s.tool_vertices.size(); ++i) {
    CheckPoint("tool_vertices", i, s.tool_vertices[i]);
  }
  std::array<std::uint32_t, kMaxTools> parts{};  // Bit per part.
  for (std::size_t i = 0; i < s.tool_meshes.size(); ++i) {
    const ToolMesh& mesh = s.tool_meshes[i];
    CheckIndex("tool_meshes", i, mesh.tool, 0, kMaxTools);
    if (mesh.part > ToolPart::kJawMinus) {
      Fail("tool_meshes", "element ", i, ": unknown part ", static_cast<std::uint32_t>(mesh.part));
    }
    const std::uint32_t part = 1u << static_cast<std::uint32_t>(mesh.part);
    if ((parts[mesh.tool] & part) != 0) {
      Fail("tool_meshes", "element ", i, ": a part of tool ", mesh.tool, " twice");
    }
    parts[mesh.tool] |= part;
    CheckRanges("tool_meshes", i, mesh, s.tool_vertices, "tool_triangles", s.tool_triangles);
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const ToolKind kind = s.tools[k].kind;
    const std::uint32_t whole = kind == ToolKind::kNone ? 0 : kind == ToolKind::kHook ? 1 : 7;
    if (parts[k] != 0 && parts[k] != whole) {
      Fail("tool_meshes", "tool ", k, ": not the parts that its kind has");
    }
  }
  for (std::size_t i = 0; i < s.tool_triangles.size(); ++i) {
    for (const Index v : s.tool_triangles[i]) {
      CheckIndex("tool_triangles", i, v, 0, s.tool_vertices.size());
    }
  }
}

void CheckStructuresAndScript(const SceneView& s) {
  for (std::size_t i = 0; i < s.protected_structures.size(); ++i) {
    const ProtectedStructure& p = s.protected_structures[i];
    if (static_cast<std::uint64_t>(p.first_point) + p.point_count > s.protected_points.size() || p.point_count < 2) {
      Fail("protected_structures", "element ", i, ": needs at least two points, all of them present");
    }
    if (p.kind > ProtectedKind::kNerve) {
      Fail("protected_structures", "element ", i, ": unknown kind ", static_cast<std::uint32_t>(p.kind));
    }
    CheckRange("protected_structures", "radius", i, p.radius_m, 1e-5, 0.1);
    CheckRange("protected_structures", "depth", i, p.depth_m, 0, 0.1);
  }
  for (std::size_t i = 0; i < s.protected_points.size(); ++i) {
    CheckPoint("protected_points", i, s.protected_points[i].p_W);
    CheckRange("protected_points", "s", i, s.protected_points[i].material.x(), -1, 1);
    CheckRange("protected_points", "t", i, s.protected_points[i].material.y(), -1, 1);
  }
  for (std::size_t i = 0; i < s.script.size(); ++i) {
    const ScriptKey& key = s.script[i];
    CheckIndex("script", i, key.tool, 0, kMaxTools);
    CheckRange("script", "time", i, key.time_s, 0, s.script_duration_s);
    CheckPoint("script", i, key.p_W);
    CheckRange("script", "jaw", i, key.jaw_rad, 0, 1.6);
    CheckRange("script", "pedals", i, key.pedals, 0, kPedalCut | kPedalCoag | kPedalBlend);
    CheckRange("script", "power", i, key.power_W, 0, 300);
    if (i > 0 && (key.tool < s.script[i - 1].tool ||
                  (key.tool == s.script[i - 1].tool && key.time_s <= s.script[i - 1].time_s))) {
      Fail("script", "element ", i, ": keys must be sorted by tool, then strictly by time");
    }
  }
}

}  // namespace

std::optional<SceneFault> FindFault(const SceneView& scene) {
  try {
    CheckParameters(scene);
    CheckParticles(scene);
    CheckConstraints(scene);
    CheckSurfaces(scene);
    CheckToolMeshes(scene);
    CheckStructuresAndScript(scene);
  } catch (const Fault& fault) {
    return fault.what;
  }
  return std::nullopt;
}

}  // namespace fulcrum::scene
