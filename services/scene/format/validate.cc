#include "services/scene/format/validate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "services/base/core/sheet_heat.h"
#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"
#include "services/scene/format/validate_checks.h"

namespace fulcrum::scene {
namespace {

/// Refuses triangles of the membrane that are turned over in the atlas: two places of the sheet would share a texel.
void CheckAtlas(const SceneView& s) {
  const std::size_t rows = s.membrane.rows, cols = s.membrane.cols;
  for (std::size_t r = 0; r + 1 < rows; ++r) {
    for (std::size_t c = 0; c + 1 < cols; ++c) {
      if (!HasCell(s, static_cast<Index>(r), static_cast<Index>(c))) continue;
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
  const bool has_grid = s.membrane.rows >= 2 && s.membrane.cols >= 2;
  const bool is_empty = s.membrane.rows == 0 && s.membrane.cols == 0;
  if (!(has_grid || is_empty) || total == 0 || nodes > kMaxMembraneNodes || total > kMaxTissueVertices) {
    Fail("scene", s.tube_vertex_count, " organ vertices and ", s.membrane.rows, " x ", s.membrane.cols,
         " membrane nodes; valid: none or at least 2 x 2, at most ", kMaxMembraneNodes, " nodes and 1 to ",
         kMaxTissueVertices, " vertices");
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
}

/// No patch of the atlas shows two sheets.
void CheckPlacesInAtlas(const SceneView& s) {
  const float patch_m = kPatchTexels * s.membrane.texel_m;
  std::vector<Eigen::AlignedBox2f> places;
  for (const SheetPart& sheet : s.sheets) {
    Eigen::AlignedBox2f& place = places.emplace_back();
    for (std::uint32_t r = sheet.first_row; r < sheet.first_row + sheet.rows; ++r) {
      for (std::uint32_t c = 0; c < sheet.cols; ++c) {
        const Vec2f& m = s.membrane_material[std::size_t{r} * s.membrane.cols + c];
        place.extend(Vec2f(std::floor(m.x() / patch_m), std::floor(m.y() / patch_m)));
      }
    }
    for (std::size_t i = 0; i + 1 < places.size(); ++i) {
      if (places[i].intersects(place)) {
        Fail("membrane_material", "sheets ", i, " and ", places.size() - 1, " share a patch of the atlas");
      }
    }
  }
}

/// Each sheet a rectangle of the grid, with enough rows between two, and all that is outside of them fixed.
void CheckSheets(const SceneView& s) {
  if (s.sheets.size() > kMaxSheets) Fail("sheets", s.sheets.size(), " of them; valid: at most ", kMaxSheets);
  std::uint64_t least = 0;
  std::uint32_t widest = 0;
  for (std::size_t i = 0; i < s.sheets.size(); ++i) {
    const SheetPart& sheet = s.sheets[i];
    if (std::memchr(sheet.name, 0, sizeof(sheet.name)) == nullptr) Fail("sheets", "element ", i, ": bad name");
    const std::uint64_t end = static_cast<std::uint64_t>(sheet.first_row) + sheet.rows;
    if (sheet.rows < 2 || sheet.cols < 2 || sheet.first_row < least || sheet.first_row % kRowsBetweenSheets != 0 ||
        end > s.membrane.rows || sheet.cols > s.membrane.cols) {
      Fail("sheets", "element ", i, ": ", sheet.rows, " x ", sheet.cols, " nodes from row ", sheet.first_row,
           "; valid: at least 2 x 2 within ", s.membrane.rows, " x ", s.membrane.cols, ", from a multiple of ",
           kRowsBetweenSheets, " and not below ", least);
    }
    if (sheet.over != kNoIndex) CheckIndex("sheets", i, sheet.over, 0, SolidCount(s));
    // 0: that of `physics`; else its bounds there, in the float of the file.
    if (sheet.Et_N_per_m != 0.0f) CheckRange("sheets", "Et", i, sheet.Et_N_per_m, double{1e-3f}, 1e7);
    CheckRange("sheets", "bending", i, sheet.bending_Nm, 0, 1);
    if (sheet.fat_youngs_modulus_Pa != 0.0f) {
      CheckRange("sheets", "fat_youngs_modulus", i, sheet.fat_youngs_modulus_Pa, 1, 1e9);
    }
    CheckRange("sheets", "tear_stretch", i, sheet.tear_stretch, 0, 10);
    if (sheet.tear_stretch != 0.0f && !(sheet.tear_stretch > 1.0f + s.physics.membrane_prestrain)) {
      Fail("sheets", "element ", i, ": tear_stretch ", sheet.tear_stretch, "; valid: above 1 + membrane_prestrain");
    }
    const auto own = [&](const char* what, float value, float low, float high) {
      if (value != 0.0f) CheckRange("sheets", what, i, value, double{low}, double{high});
    };
    own("thickness", sheet.thickness_m, kSheetThicknessMin_m, kSheetThicknessMax_m);
    own("conductivity", sheet.conductivity_W_mK, kSheetConductivityMin_W_mK, kSheetConductivityMax_W_mK);
    own("sigma", sheet.sigma_S_m, kSheetSigmaMin_S_m, kSheetSigmaMax_S_m);
    least = end + kRowsBetweenSheets;
    widest = std::max(widest, sheet.cols);
  }
  if (s.sheets.empty()) return;
  const SheetPart& last = s.sheets.back();
  if (s.sheets[0].first_row != 0 || last.first_row + last.rows != s.membrane.rows || widest != s.membrane.cols) {
    Fail("sheets", "they do not fill the grid of ", s.membrane.rows, " x ", s.membrane.cols, " nodes");
  }
  CheckPlacesInAtlas(s);
  const std::vector<std::uint8_t> absent = AbsentNodes(s);
  for (std::size_t i = 0; i < absent.size(); ++i) {
    if (absent[i] != 0 && s.inverse_mass[s.membrane.first + i] != 0) {
      Fail("inverse_mass", "node ", i, " of the grid belongs to no sheet and is not fixed");
    }
  }
  const auto of_sheet = [&](const char* section, std::size_t element, Index particle) {
    if (particle >= s.membrane.first && particle < s.rest_position.size() && absent[particle - s.membrane.first] != 0) {
      Fail(section, "element ", element, ": on a node of the grid that belongs to no sheet");
    }
  };
  for (std::size_t i = 0; i < s.bindings.size(); ++i) of_sheet("bindings", i, s.bindings[i].membrane);
  for (std::size_t i = 0; i < s.bending.size(); ++i) {
    for (const Index v : s.bending[i].v) of_sheet("bending", i, v);
  }
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
  const std::vector<std::uint8_t> absent = AbsentNodes(s);
  for (std::size_t i = 0; i < s.membrane_rest_length.size(); ++i) {
    const std::size_t r = i / 3 / cols, c = i / 3 % cols, k = i % 3;
    const bool is_inside = (k == 0 || r + 1 < rows) && (k == 1 || c + 1 < cols);
    const bool exists = is_inside && absent[i / 3] == 0 && absent[i / 3 + (k == 0 ? 1 : k == 1 ? cols : cols + 1)] == 0;
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

constexpr float kUnitTolerance = 1e-3f;  ///< Rounding of a normal's length.

/// Each element within one solid, each solid a range after the last one.
void CheckSolids(const SceneView& s) {
  if (s.solids.empty() && s.attachments.empty()) return;
  if (s.solids.size() > kMaxSolids) Fail("solids", s.solids.size(), " of them; valid: at most ", kMaxSolids);
  std::uint64_t vertex = 0, surface_vertex = 0, surface_triangle = 0;
  const auto follow = [](std::size_t solid, const char* what, std::uint64_t first, std::uint64_t count,
                         std::uint64_t* end) {
    if (first != *end) Fail("solids", "element ", solid, ": its ", what, " begin at ", first, "; valid: ", *end);
    *end += count;
  };
  for (std::size_t i = 0; i < s.solids.size(); ++i) {
    const Solid& solid = s.solids[i];
    follow(i, "vertices", solid.first_vertex, solid.vertex_count, &vertex);
    follow(i, "surface vertices", solid.first_surface_vertex, solid.surface_vertex_count, &surface_vertex);
    follow(i, "surface triangles", solid.first_surface_triangle, solid.surface_triangle_count, &surface_triangle);
    CheckRange("solids", "number of vertices", i, solid.vertex_count, 4, s.tube_vertex_count);
    CheckRange("solids", "Young's modulus", i, solid.youngs_modulus_Pa, 1, 1e9);
    if (std::memchr(solid.name, 0, sizeof(solid.name)) == nullptr ||
        static_cast<std::uint32_t>(solid.look) >= kSolidLooks) {
      Fail("solids", "element ", i, ": bad name or look");
    }
  }
  if (!s.solids.empty()) {
    CheckSize("solids", vertex, s.tube_vertex_count);
    CheckSize("solids", surface_vertex, s.surface_vertices.size());
    CheckSize("solids", surface_triangle, s.surface_triangles.size());
  }
  const std::vector<Index> of = SolidOfVertices(s);
  const auto one_solid = [&](const char* section, std::size_t element, const auto& vertices) {
    for (const Index v : vertices) {
      if (of[v] != of[vertices[0]]) Fail(section, "element ", element, ": in two solids");
    }
  };
  for (std::size_t i = 0; i < s.tets.size(); ++i) one_solid("tets", i, s.tets[i]);
  for (std::size_t i = 0; i < s.tube_edges.size(); ++i) one_solid("tube_edges", i, ParticlesOf(s.tube_edges[i]));
  for (std::size_t i = 0; i < s.tube_surface.size(); ++i) one_solid("tube_surface", i, s.tube_surface[i]);
  for (std::size_t i = 0; i < s.bindings.size(); ++i) one_solid("bindings", i, s.bindings[i].surface);
  for (std::size_t i = 0; i < s.solids.size(); ++i) {
    const Solid& solid = s.solids[i];
    const Index first = solid.first_surface_vertex, end = first + solid.surface_vertex_count;
    for (Index v = first; v < end; ++v) {
      if (of[s.tets[s.surface_vertices[v].tetrahedron][0]] != i) {
        Fail("surface_vertices", "element ", v, ": carried by another solid");
      }
    }
    for (Index t = solid.first_surface_triangle; t < solid.first_surface_triangle + solid.surface_triangle_count; ++t) {
      for (const Index v : s.surface_triangles[t]) CheckIndex("surface_triangles", t, v, first, end);
    }
  }
  std::set<Triangle> surface;
  for (std::size_t i = 0; i < s.attachments.size(); ++i) {
    const Attachment& a = s.attachments[i];
    CheckIndex("attachments", i, a.vertex, 0, s.tube_vertex_count);
    for (const Index v : a.surface) CheckIndex("attachments", i, v, 0, s.tube_vertex_count);
    CheckDistinct("attachments", i, a.surface);
    one_solid("attachments", i, a.surface);
    if (of[a.vertex] == of[a.surface[0]]) Fail("attachments", "element ", i, ": joins a solid with itself");
    CheckWeights("attachments", i, a.barycentric);
    CheckRange("attachments", "stiffness", i, a.stiffness_N_per_m, 0, 1e6);
    if (a.normal.isZero(0.0f)) continue;
    // What slides names a triangle of the surface.
    CheckRange("attachments", "length of the normal", i, a.normal.norm(), 1 - kUnitTolerance, 1 + kUnitTolerance);
    if (surface.empty()) surface.insert(s.tube_surface.begin(), s.tube_surface.end());
    if (!surface.contains(a.surface)) Fail("attachments", "element ", i, ": slides on no triangle of tube_surface");
  }
  if (!s.attachments.empty() && s.physics.mode != PhysicsMode::kAccurate) {
    Fail("attachments", s.attachments.size(), " of them; only mode accurate has any");
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
    const std::uint32_t whole = kind == ToolKind::kNone                                 ? 0
                                : kind == ToolKind::kHook || kind == ToolKind::kSuction ? 1
                                                                                        : 7;
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
  if (s.planned_line.size() == 1) {
    Fail("planned_line", "needs at least two points");
  }
  for (std::size_t i = 0; i < s.planned_line.size(); ++i) {
    CheckRange("planned_line", "s", i, s.planned_line[i].x(), -1, 1);
    CheckRange("planned_line", "t", i, s.planned_line[i].y(), -1, 1);
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
    CheckSheets(scene);
    CheckConstraints(scene);
    CheckAtlas(scene);
    CheckSurfaces(scene);
    CheckSolids(scene);
    CheckToolMeshes(scene);
    CheckStructuresAndScript(scene);
  } catch (const Fault& fault) {
    return fault.what;
  }
  return std::nullopt;
}

}  // namespace fulcrum::scene
