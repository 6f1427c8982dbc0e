// Constraints, masses, colours, bindings, embedding, structures and script over an anatomy: the same for every kind of
// scene.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "services/base/core/error.h"
#include "services/base/core/scope.h"
#include "services/base/core/sheets.h"
#include "services/scene/builder/attachments.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/builder/sheets.h"
#include "services/scene/format/colouring.h"

namespace fulcrum::scene {
namespace {

/// Distance between points of the planned line, in fractions of the sheet: the sheet is curved between given points.
constexpr float kLineStep = 0.01f;
constexpr int kStructurePoints = 33;  ///< Along each ureter or nerve: 6 mm apart on a 200 mm sheet.
/// Largest distance of a tip from the pivot: a laparoscopic shaft is about 330 mm long.
constexpr double kLongestReach_m = 0.30;
/// Smallest distance of a tip from the pivot, and of the pivot from the end of the shaft: the haptic devices cannot
/// turn a shorter lever.
constexpr double kLeastLever_m = 0.015;

void CheckSheet(const SceneSettings& settings, const SheetBody& sheet) {
  const MembraneSettings& m = sheet.grid;
  if (m.rows < 2 || m.cols < 2 || sheet.nodes.size() != static_cast<std::size_t>(m.rows) * m.cols) {
    Refuse(settings, sheet.name + ": needs at least 2 x 2 nodes");
  }
  if ((m.rows - 1) % m.bending_row_stride != 0 || (m.cols - 1) % m.bending_col_stride != 0) {
    Refuse(settings, sheet.name + ": the bending strides (" + std::to_string(m.bending_row_stride) + ", " +
                         std::to_string(m.bending_col_stride) + ") must divide rows - 1 = " +
                         std::to_string(m.rows - 1) + " and cols - 1 = " + std::to_string(m.cols - 1));
  }
}

void CheckCounts(const SceneSettings& settings, const Anatomy& anatomy, const MembraneGrid& grid) {
  const std::size_t nodes = grid.node_count();
  std::size_t total = nodes;
  for (const SolidBody& body : anatomy.solids) total += body.vertices.size();
  if (total == 0) Refuse(settings, "there is no tissue: neither an organ nor bodies nor sheets");
  if (anatomy.sheets.size() > kMaxSheets) {
    Refuse(settings, std::to_string(anatomy.sheets.size()) + " sheets; valid: at most " + std::to_string(kMaxSheets));
  }
  if (!settings.any_size && (total > kMaxTissueVertices || nodes > kMaxMembraneNodes)) {
    // Physics, heat, haptics, picture and supervisor together: 350 MB with 20,560 vertices, 845 MB with 204,972.
    const std::size_t memory_MB = 295 + total / 373;
    Refuse(settings, std::to_string(total) + " vertices (" + std::to_string(nodes) +
                         " of them in the membrane), for which a session would need " + std::to_string(memory_MB) +
                         " MB; valid: at most " + std::to_string(kMaxTissueVertices) +
                         ". Lower membrane rows or columns, or the number of tetrahedra of the organ or of a body");
  }
  for (const SheetBody& sheet : anatomy.sheets) CheckSheet(settings, sheet);
}

void AddParticles(const SceneSettings& settings, const Anatomy& anatomy, SceneData* scene) {
  std::vector<double> mass(scene->fixed.tube_vertex_count, 0.0);
  std::vector<bool> held;
  for (const SolidBody& body : anatomy.solids) {
    const std::size_t first = held.size();
    for (std::size_t i = 0; i < body.tets.size(); ++i) {
      const Tetrahedron& t = body.tets[i];
      const auto& x = body.vertices;
      const double volume = SignedVolume(x[t[0]], x[t[1]], x[t[2]], x[t[3]]);
      if (!(volume > 0)) {
        Refuse(settings, body.name + ": tetrahedron " + std::to_string(i) + " has no positive volume");
      }
      for (const Index v : t) {
        mass[first + v] += body.material.density_kg_m3 * volume / 4;
      }
    }
    held.insert(held.end(), body.fixed.begin(), body.fixed.end());
    for (const Vec3d& p : body.vertices) scene->rest_position.push_back(p.cast<float>());
  }
  for (std::size_t i = 0; i < mass.size(); ++i) {
    if (!held[i] && !(mass[i] > 0)) {
      Refuse(settings, "particle " + std::to_string(i) + " has no mass: it belongs to no element");
    }
    scene->inverse_mass.push_back(held[i] ? 0.0f : static_cast<float>(1 / mass[i]));
  }
}

double RestLength(const SceneData& scene, Index a, Index b) {
  return (scene.rest_position[a].cast<double>() - scene.rest_position[b].cast<double>()).norm();
}

/// The visible surface of a solid whose vertices begin at `first`, carried by its own tetrahedra.
void Embed(const SolidBody& body, Index first, const std::vector<Vec3d>& vertices, SceneData* scene) {
  std::vector<Tetrahedron> own;
  std::vector<Index> at;
  for (Index i = 0; i < scene->tets.size(); ++i) {
    if (scene->tets[i][0] >= first && scene->tets[i][0] - first < body.vertices.size()) {
      own.push_back(scene->tets[i]);
      at.push_back(i);
    }
  }
  const auto base = static_cast<Index>(scene->surface_vertices.size());
  for (const Triangle& t : body.surface_triangles) {
    scene->surface_triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  }
  for (const Embedding& e : EmbedPoints(vertices, own, body.surface_vertices)) {
    EmbeddedVertex vertex{at[e.tetrahedron], {}};
    for (int k = 0; k < 4; ++k) {
      vertex.barycentric[k] = static_cast<float>(e.barycentric[k]);
    }
    scene->surface_vertices.push_back(vertex);
  }
}

/// Returns the vertices of all solids, in double.
std::vector<Vec3d> AddSolids(const Anatomy& anatomy, bool has_organ, SceneData* scene) {
  std::vector<Vec3d> vertices;
  for (const SolidBody& body : anatomy.solids) {
    const auto first = static_cast<Index>(vertices.size());
    for (const Tetrahedron& t : body.tets)
      scene->tets.push_back({t[0] + first, t[1] + first, t[2] + first, t[3] + first});
    vertices.insert(vertices.end(), body.vertices.begin(), body.vertices.end());
  }
  // Before the tetrahedra are sorted by colour.
  scene->tube_surface = BoundaryOf(scene->tets);
  for (const auto& [a, b] : EdgesOf(scene->tets)) {
    scene->tube_edges.push_back({a, b, static_cast<float>(RestLength(*scene, a, b))});
  }
  // And these before the embedding, because surface vertices refer to their tetrahedron by its index.
  scene->tet_colours = SortByColour(&scene->tets, vertices.size(), [](const Tetrahedron& t) { return ParticlesOf(t); });
  // One organ that looks like bowel is what a scene without a list of solids has.
  const bool is_listed =
      !has_organ || anatomy.solids.size() > 1 || anatomy.solids[0].material.look != SolidLook::kBowel;
  Index first = 0;
  for (const SolidBody& body : anatomy.solids) {
    Solid solid{};
    std::strncpy(solid.name, body.name.c_str(), sizeof(solid.name) - 1);
    solid.look = body.material.look;
    solid.youngs_modulus_Pa = static_cast<float>(body.material.youngs_modulus_Pa);
    solid.first_vertex = first;
    solid.vertex_count = static_cast<Index>(body.vertices.size());
    solid.first_surface_vertex = static_cast<Index>(scene->surface_vertices.size());
    solid.surface_vertex_count = static_cast<Index>(body.surface_vertices.size());
    solid.first_surface_triangle = static_cast<Index>(scene->surface_triangles.size());
    solid.surface_triangle_count = static_cast<Index>(body.surface_triangles.size());
    Embed(body, first, vertices, scene);
    first += solid.vertex_count;
    if (is_listed) scene->solids.push_back(solid);
  }
  return vertices;
}

void AddSurroundings(const Anatomy& anatomy, SceneData* scene) {
  for (const Anatomy::Surrounding& s : anatomy.surroundings) {
    StaticSurface surface{};
    std::strncpy(surface.name, s.name.c_str(), sizeof(surface.name) - 1);
    surface.role = s.role;
    surface.first_vertex = static_cast<Index>(scene->static_vertices.size());
    surface.vertex_count = static_cast<Index>(s.vertices.size());
    surface.first_triangle = static_cast<Index>(scene->static_triangles.size());
    surface.triangle_count = static_cast<Index>(s.triangles.size());
    surface.collides = s.collides ? 1 : 0;
    for (const Vec3d& p : s.vertices) {
      scene->static_vertices.push_back(p.cast<float>());
    }
    for (const Triangle& t : s.triangles) {
      scene->static_triangles.push_back(
          {t[0] + surface.first_vertex, t[1] + surface.first_vertex, t[2] + surface.first_vertex});
    }
    scene->static_surfaces.push_back(surface);
  }
}

/// The sheet of a name; none: the first one. `user` for the message.
const PlacedSheet& SheetNamed(const SceneSettings& settings, const std::vector<PlacedSheet>& sheets,
                              const std::string& name, const std::string& user) {
  std::string names;
  for (const PlacedSheet& sheet : sheets) {
    if (name.empty() || name == sheet.name()) return sheet;
    names += (names.empty() ? "" : ", ") + sheet.name();
  }
  if (sheets.empty()) Refuse(settings, user + ": a place on a sheet, but the scene has none");
  Refuse(settings, user + ": no sheet '" + name + "'; the scene has " + names);
}

void AddStructures(const SceneSettings& settings, const std::vector<PlacedSheet>& sheets, SceneData* scene) {
  for (const StructureSettings& s : settings.structures) {
    if (s.path.size() < 2) {
      Refuse(settings, "a protected structure needs at least two points");
    }
    const PlacedSheet& sheet = SheetNamed(settings, sheets, "", "structures");
    ProtectedStructure structure{s.kind, static_cast<float>(s.radius_m), static_cast<float>(s.depth_m),
                                 static_cast<Index>(scene->protected_points.size()), kStructurePoints};
    for (int i = 0; i < kStructurePoints; ++i) {
      const double x = static_cast<double>(i) / (kStructurePoints - 1) * static_cast<double>(s.path.size() - 1);
      const auto k = std::min(static_cast<std::size_t>(x), s.path.size() - 2);
      const auto f = static_cast<float>(x - static_cast<double>(k));
      const Vec2f &p1 = s.path[k], &p2 = s.path[k + 1];
      const Vec2f p0 = k > 0 ? s.path[k - 1] : Vec2f(2 * p1 - p2);
      const Vec2f p3 = k + 2 < s.path.size() ? s.path[k + 2] : Vec2f(2 * p2 - p1);
      const Vec2f q = CatmullRom(p0, p1, p2, p3, f);
      const PlacedSheet::Point at = sheet.At(q.x(), q.y());
      scene->protected_points.push_back({(at.p - s.depth_m * at.normal).cast<float>(), at.material});
    }
    scene->protected_structures.push_back(structure);
  }
}

/// Bit per tool: it is a scope.
std::uint32_t ScopesOf(const SceneSettings& settings) {
  std::uint32_t scopes = 0;
  for (std::size_t i = 0; i < settings.tools.size(); ++i) {
    if (settings.tools[i].kind == ToolKind::kScope) scopes |= 1u << i;
  }
  return scopes;
}

void AddScript(const SceneSettings& settings, const std::vector<PlacedSheet>& sheets, SceneData* scene) {
  for (const ScriptKeySettings& key : settings.script) {
    if (key.tool < 0 || key.tool >= kMaxTools || settings.tools[key.tool].kind == ToolKind::kNone) {
      Refuse(settings, "script key at " + std::to_string(key.time_s) + " s: no tool " + std::to_string(key.tool));
    }
    if (key.time_s < 0 || key.time_s > settings.script_duration_s) {
      Refuse(settings, "script key at " + std::to_string(key.time_s) + " s lies outside the script of " +
                           std::to_string(settings.script_duration_s) + " s");
    }
    Vec3f p = key.world_m.value_or(Vec3f::Zero());
    if (!key.world_m) {
      const PlacedSheet::Point at = SheetNamed(settings, sheets, key.on, "script").At(key.sheet.x(), key.sheet.y());
      const ToolDescription& tool = settings.tools[key.tool];
      p = tool.kind == ToolKind::kScope ? TipLookingAt(at.p.cast<float>() + key.offset_m,
                                                       static_cast<float>(key.height_m), tool.p_WP, settings.render)
                                        : Vec3f((at.p + key.height_m * at.normal).cast<float>() + key.offset_m);
    }
    const double reach = (p - settings.tools[key.tool].p_WP).norm();
    const double longest = std::min(kLongestReach_m, settings.tools[key.tool].shaft_length_m - kLeastLever_m);
    if (!(reach >= kLeastLever_m && reach <= longest)) {
      Refuse(settings, "script key at " + std::to_string(key.time_s) + " s: tip " + std::to_string(1e3 * reach) +
                           " mm from the trocar of tool " + std::to_string(key.tool) + "; valid: " +
                           std::to_string(1e3 * kLeastLever_m) + " to " + std::to_string(1e3 * longest) + " mm");
    }
    scene->script.push_back({static_cast<float>(key.time_s), static_cast<std::uint32_t>(key.tool), p,
                             static_cast<float>(key.jaw_rad), key.pedals, static_cast<float>(key.power_W),
                             static_cast<float>(key.roll_rad)});
  }
  std::stable_sort(scene->script.begin(), scene->script.end(), [](const ScriptKey& a, const ScriptKey& b) {
    return a.tool != b.tool ? a.tool < b.tool : a.time_s < b.time_s;
  });
  if (settings.hand)
    scene->script = Perform(scene->script, *settings.hand, settings.script_duration_s, ScopesOf(settings));
  scene->fixed.script_duration_s = static_cast<float>(settings.script_duration_s);
}

void AddPlannedLine(const SceneSettings& settings, const std::vector<PlacedSheet>& sheets, SceneData* scene) {
  for (std::size_t i = 0; i < settings.planned_line.size(); ++i) {
    const Vec2f& to = settings.planned_line[i];
    const Vec2f& from = settings.planned_line[i > 0 ? i - 1 : 0];
    const int parts = i > 0 ? std::max(1, static_cast<int>(std::ceil((to - from).norm() / kLineStep))) : 1;
    for (int k = 1; k <= parts; ++k) {
      const Vec2f at = from + static_cast<float>(k) / static_cast<float>(parts) * (to - from);
      scene->planned_line.push_back(SheetNamed(settings, sheets, "", "assessment").At(at.x(), at.y()).material);
    }
  }
}

}  // namespace

void Refuse(const SceneSettings& settings, const std::string& text) {
  throw InputError("scene '" + settings.name + "': " + text);
}

SceneData AssembleScene(const SceneSettings& settings, const Anatomy& anatomy) {
  SceneData scene;
  SceneView& fixed = scene.fixed;
  std::strncpy(fixed.name, settings.name.c_str(), sizeof(fixed.name) - 1);
  fixed.physics = settings.physics;
  fixed.thermal = settings.thermal;
  fixed.render = settings.render;
  fixed.stereo = settings.stereo;
  fixed.haptics = settings.haptics;
  fixed.breathing = settings.breathing;
  fixed.assessment = settings.assessment;
  fixed.tools = settings.tools;
  fixed.node_mask = settings.node_mask;
  for (const SolidBody& body : anatomy.solids) fixed.tube_vertex_count += static_cast<Index>(body.vertices.size());
  const std::vector<SheetPart> parts = PlaceSheets(anatomy.sheets);
  fixed.membrane.first = fixed.tube_vertex_count;
  for (const SheetPart& part : parts) {
    fixed.membrane.rows = part.first_row + part.rows;
    fixed.membrane.cols = std::max(fixed.membrane.cols, part.cols);
  }
  CheckCounts(settings, anatomy, fixed.membrane);
  // One membrane that fills the grid is what a scene without a list of sheets has.
  if (!settings.has_organ || parts.size() > 1) scene.sheets = parts;

  AddParticles(settings, anatomy, &scene);
  AddSheetParticles(anatomy.sheets, parts, &scene);
  const std::vector<Vec3d> vertices = AddSolids(anatomy, settings.has_organ, &scene);
  AddSheetConstraints(anatomy.sheets, parts, &scene);
  AddBindings(settings, anatomy, parts, vertices, &scene);
  AddAttachments(settings, anatomy, vertices, &scene);
  scene.membrane_material = SheetMaterial(settings, anatomy.sheets, parts, fixed.membrane);
  AddSurroundings(anatomy, &scene);
  std::vector<PlacedSheet> sheets;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    sheets.emplace_back(anatomy.sheets[i], parts[i], fixed.membrane, scene.membrane_material);
  }
  AddStructures(settings, sheets, &scene);
  AddScript(settings, sheets, &scene);
  AddPlannedLine(settings, sheets, &scene);

  const std::size_t n = scene.rest_position.size();
  const auto particles = [](const auto& c) { return ParticlesOf(c); };
  scene.tube_edge_colours = SortByColour(&scene.tube_edges, n, particles);
  scene.bending_colours = SortByColour(&scene.bending, n, particles);
  scene.binding_colours = SortByColour(&scene.bindings, n, particles);
  fixed.hash = ContentHash(scene.View());
  return scene;
}

}  // namespace fulcrum::scene
