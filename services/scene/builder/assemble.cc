// Constraints, masses, colours, bindings, embedding, structures and script over an anatomy: the same for every kind of
// scene.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "services/base/core/error.h"
#include "services/base/core/scope.h"
#include "services/base/core/solids.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/flatten.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/format/colouring.h"

namespace fulcrum::scene {
namespace {

constexpr double kAtlasMargin_m = 0.001;  ///< Smallest sheet coordinate, so that a patch has texels on all sides.
/// Distance between points of the planned line, in fractions of the sheet: the sheet is curved between given points.
constexpr float kLineStep = 0.01f;
constexpr int kStructurePoints = 33;  ///< Along each ureter or nerve: 6 mm apart on a 200 mm sheet.
/// Largest distance of a tip from the pivot: a laparoscopic shaft is about 330 mm long.
constexpr double kLongestReach_m = 0.30;
/// Smallest distance of a tip from the pivot, and of the pivot from the end of the shaft: the haptic devices cannot
/// turn a shorter lever.
constexpr double kLeastLever_m = 0.015;

[[noreturn]] void Refuse(const SceneSettings& settings, const std::string& text) {
  throw InputError("scene '" + settings.name + "': " + text);
}

/// Point and outward normal of the sheet at fractions (s, t), bilinear between its nodes.
struct SheetPoint {
  Vec3d p, normal;
  Vec2f material;
};

class Sheet {
 public:
  Sheet(const MembraneSettings& settings, const std::vector<Vec3d>& nodes, const std::vector<Vec2f>& material)
      : rows_(settings.rows), cols_(settings.cols), nodes_(nodes), material_(material) {}

  [[nodiscard]] SheetPoint At(double s, double t) const {
    const double x = std::clamp(s, 0.0, 1.0) * (cols_ - 1), y = std::clamp(t, 0.0, 1.0) * (rows_ - 1);
    const int c = std::min(static_cast<int>(x), cols_ - 2), r = std::min(static_cast<int>(y), rows_ - 2);
    const double u = x - c, v = y - r;
    const auto node = [&](int dr, int dc) {
      return static_cast<std::size_t>(r + dr) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(c + dc);
    };
    const Vec3d &p00 = nodes_[node(0, 0)], &p01 = nodes_[node(0, 1)], &p10 = nodes_[node(1, 0)],
                &p11 = nodes_[node(1, 1)];
    SheetPoint result;
    result.p = (1 - v) * ((1 - u) * p00 + u * p01) + v * ((1 - u) * p10 + u * p11);
    const Vec3d ds = (1 - v) * (p01 - p00) + v * (p11 - p10), dt = (1 - u) * (p10 - p00) + u * (p11 - p01);
    result.normal = ds.cross(dt).normalized();
    const auto fu = static_cast<float>(u), fv = static_cast<float>(v);
    result.material = (1 - fv) * ((1 - fu) * material_[node(0, 0)] + fu * material_[node(0, 1)]) +
                      fv * ((1 - fu) * material_[node(1, 0)] + fu * material_[node(1, 1)]);
    return result;
  }

 private:
  int rows_, cols_;
  const std::vector<Vec3d>& nodes_;
  const std::vector<Vec2f>& material_;
};

void CheckCounts(const SceneSettings& settings, const Anatomy& anatomy) {
  const MembraneSettings& m = settings.membrane;
  std::size_t total = anatomy.sheet.size();
  for (const SolidBody& body : anatomy.solids) total += body.vertices.size();
  if (m.rows < 3 || m.cols < 3 || anatomy.sheet.size() != static_cast<std::size_t>(m.rows) * m.cols) {
    Refuse(settings, "the membrane needs at least 3 x 3 nodes");
  }
  if (!settings.any_size && (total > kMaxTissueVertices || anatomy.sheet.size() > kMaxMembraneNodes)) {
    // Physics, heat, haptics, picture and supervisor together: 350 MB with 20,560 vertices, 845 MB with 204,972.
    const std::size_t memory_MB = 295 + total / 373;
    Refuse(settings, std::to_string(total) + " vertices (" + std::to_string(anatomy.sheet.size()) +
                         " of them in the membrane), for which a session would need " + std::to_string(memory_MB) +
                         " MB; valid: at most " + std::to_string(kMaxTissueVertices) +
                         ". Lower membrane rows or columns, or the number of tetrahedra of the organ or of a body");
  }
  if ((m.rows - 1) % m.bending_row_stride != 0 || (m.cols - 1) % m.bending_col_stride != 0) {
    Refuse(settings, "the bending strides (" + std::to_string(m.bending_row_stride) + ", " +
                         std::to_string(m.bending_col_stride) + ") must divide rows - 1 = " +
                         std::to_string(m.rows - 1) + " and cols - 1 = " + std::to_string(m.cols - 1));
  }
}

/// Material coordinates, offset from the edge of the atlas.
std::vector<Vec2f> MaterialOf(const SceneSettings& settings, const std::vector<Vec3d>& sheet) {
  const std::vector<Eigen::Vector2d> flat = FlattenSheet(settings.membrane.rows, settings.membrane.cols, sheet);
  Eigen::Vector2d extent = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& m : flat) {
    if (!m.allFinite()) {
      Refuse(settings, "the membrane cannot be flattened: it has degenerate triangles");
    }
    extent = extent.cwiseMax(m);
  }
  const double limit = kAtlasTexels * static_cast<double>(MembraneGrid().texel_m) - 2 * kAtlasMargin_m;
  if (extent.maxCoeff() > limit) {
    std::ostringstream text;
    text << "the membrane is " << 1e3 * extent.x() << " x " << 1e3 * extent.y() << " mm when flattened; valid: at most "
         << 1e3 * limit << " mm either way (the atlas)";
    Refuse(settings, text.str());
  }
  std::vector<Vec2f> material;
  material.reserve(flat.size());
  for (const Eigen::Vector2d& m : flat) {
    material.push_back((m + Eigen::Vector2d::Constant(kAtlasMargin_m)).cast<float>());
  }
  return material;
}

void AddParticles(const SceneSettings& settings, const Anatomy& anatomy, SceneData* scene) {
  const int rows = settings.membrane.rows, cols = settings.membrane.cols;
  const std::size_t organ_count = scene->fixed.tube_vertex_count;
  std::vector<double> mass(organ_count + anatomy.sheet.size(), 0.0);
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
  for (const Vec3d& p : anatomy.sheet) scene->rest_position.push_back(p.cast<float>());
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < cols; ++c) {
      const std::size_t n00 = static_cast<std::size_t>(r) * cols + c;
      for (const auto& t : {std::array{n00, n00 + 1, n00 + cols + 1}, std::array{n00, n00 + cols + 1, n00 + cols}}) {
        const Vec3d &a = anatomy.sheet[t[0]], &b = anatomy.sheet[t[1]], &d = anatomy.sheet[t[2]];
        const double area = (b - a).cross(d - a).norm() / 2;
        for (const std::size_t v : t) {
          mass[organ_count + v] += settings.membrane.density_kg_m2 * area / 3;
        }
      }
    }
  }
  scene->inverse_mass.resize(mass.size());
  for (std::size_t i = 0; i < mass.size(); ++i) {
    bool fixed = false;
    if (i < organ_count) {
      fixed = held[i];
    } else {
      const auto r = static_cast<int>((i - organ_count) / cols), c = static_cast<int>((i - organ_count) % cols);
      fixed = r == 0 || r == rows - 1 || c == 0 || c == cols - 1;
    }
    if (!fixed && !(mass[i] > 0)) {
      Refuse(settings, "particle " + std::to_string(i) + " has no mass: it belongs to no element");
    }
    scene->inverse_mass[i] = fixed ? 0.0f : static_cast<float>(1 / mass[i]);
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
std::vector<Vec3d> AddSolids(const Anatomy& anatomy, SceneData* scene) {
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
  const bool is_listed = anatomy.solids.size() > 1 || anatomy.solids[0].material.look != SolidLook::kBowel;
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

void AddMembrane(const SceneSettings& settings, SceneData* scene) {
  const int rows = settings.membrane.rows, cols = settings.membrane.cols;
  const Index first = scene->fixed.membrane.first;
  const auto node = [&](int r, int c) { return first + static_cast<Index>(r) * cols + c; };
  scene->membrane_rest_length.assign(3 * static_cast<std::size_t>(rows) * cols, 0.0f);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      constexpr int kStep[3][2] = {{0, 1}, {1, 0}, {1, 1}};
      for (int k = 0; k < 3; ++k) {
        const int r2 = r + kStep[k][0], c2 = c + kStep[k][1];
        if (r2 < rows && c2 < cols) {
          scene->membrane_rest_length[3 * (static_cast<std::size_t>(r) * cols + c) + k] =
              static_cast<float>(RestLength(*scene, node(r, c), node(r2, c2)));
        }
      }
    }
  }
  const int dr = settings.membrane.bending_row_stride, dc = settings.membrane.bending_col_stride;
  const auto add = [&](Index v0, Index v1, Index v2, Index v3) {
    const auto x = [&](Index v) { return Vec3d(scene->rest_position[v].cast<double>()); };
    scene->bending.push_back({{v0, v1, v2, v3}, static_cast<float>(DihedralAngle(x(v0), x(v1), x(v2), x(v3)))});
  };
  //   n10 --- n11      interior edges of the coarse sheet: each cell's diagonal n00-n11; the edge n00-n01 where a
  //    |   /   |       row of cells lies below it; the edge n00-n10 where a column of cells lies to its left. The
  //   n00 --- n01      wings are chosen so that both normals point outward (s x t).
  for (int r = 0; r + dr < rows; r += dr) {
    for (int c = 0; c + dc < cols; c += dc) {
      add(node(r, c), node(r + dr, c + dc), node(r + dr, c), node(r, c + dc));
      if (r > 0) {
        add(node(r, c), node(r, c + dc), node(r + dr, c + dc), node(r - dr, c));
      }
      if (c > 0) {
        add(node(r, c), node(r + dr, c), node(r, c - dc), node(r + dr, c + dc));
      }
    }
  }
}

void AddBindings(const SceneSettings& settings, const Anatomy& anatomy, const std::vector<Vec3d>& vertices,
                 SceneData* scene) {
  const MembraneSettings& m = settings.membrane;
  std::vector<Triangle> surface;
  for (const Triangle& t : scene->tube_surface) {
    if (t[0] < anatomy.solids[0].vertices.size()) surface.push_back(t);
  }
  const TriangleLocator locator(vertices, surface);
  for (int r = m.binding_row_stride / 2; r < m.rows; r += m.binding_row_stride) {
    for (int c = m.binding_col_stride / 2 + 1; c < m.cols; c += m.binding_col_stride) {
      const std::size_t i = static_cast<std::size_t>(r) * m.cols + c;
      const Index particle = scene->fixed.membrane.first + static_cast<Index>(i);
      const auto hit = locator.Closest(anatomy.sheet[i], m.binding_reach_m);
      if (hit.triangle == kNoIndex || scene->inverse_mass[particle] == 0) {
        continue;
      }
      Binding binding{particle, surface[hit.triangle], {}, static_cast<float>(hit.closest.distance)};
      for (int k = 0; k < 3; ++k) {
        binding.barycentric[k] = static_cast<float>(hit.closest.barycentric[k]);
      }
      scene->bindings.push_back(binding);
    }
  }
  if (scene->bindings.empty()) {
    std::ostringstream text;
    text << "no membrane node lies within binding_reach = " << 1e3 * m.binding_reach_m << " mm of the organ";
    Refuse(settings, text.str());
  }
}

/// Springs from every vertex of a body's surface to the nearest point of another one within reach: a column of tissue
/// over the vertex's share of the surface, as long as the distance.
void AddAttachments(const SceneSettings& settings, const Anatomy& anatomy, const std::vector<Vec3d>& vertices,
                    SceneData* scene) {
  constexpr double kLeastLength_m = 1e-3;  // Of the column, where bodies touch.
  constexpr double kStiffest_N_per_m = 1e5;
  if (!settings.attach.empty() && settings.physics.mode != PhysicsMode::kAccurate) {
    Refuse(settings, "attach: only `physics.mode: accurate` has attachments");
  }
  const std::vector<Index> solid = SolidOfVertices(scene->View());
  const auto find = [&](const std::string& name) {
    const auto at = std::ranges::find(anatomy.solids, name, &SolidBody::name);
    if (at == anatomy.solids.end()) Refuse(settings, "attach: no body '" + name + "'");
    return static_cast<Index>(at - anatomy.solids.begin());
  };
  for (const AttachSettings& attach : settings.attach) {
    const Index from = find(attach.from), to = find(attach.to);
    std::vector<Triangle> surface;
    std::vector<double> area(vertices.size());
    for (const Triangle& t : scene->tube_surface) {
      if (solid[t[0]] == to) surface.push_back(t);
      if (solid[t[0]] != from) continue;
      const Vec3d &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
      for (const Index v : t) area[v] += (b - a).cross(c - a).norm() / 6;
    }
    const std::size_t before = scene->attachments.size();
    const TriangleLocator locator(vertices, surface);
    for (Index v = 0; v < vertices.size(); ++v) {
      if (!(area[v] > 0)) continue;
      const auto hit = locator.Closest(vertices[v], attach.reach_m);
      if (hit.triangle == kNoIndex) continue;
      Attachment a{v, surface[hit.triangle], {}, 0};
      for (int k = 0; k < 3; ++k) a.barycentric[k] = static_cast<float>(hit.closest.barycentric[k]);
      const double stiffness = attach.youngs_modulus_Pa * area[v] / std::max(hit.closest.distance, kLeastLength_m);
      a.stiffness_N_per_m = static_cast<float>(std::min(stiffness, kStiffest_N_per_m));
      scene->attachments.push_back(a);
    }
    if (scene->attachments.size() == before) {
      std::ostringstream text;
      text << "attach: no vertex of '" << attach.from << "' lies within " << 1e3 * attach.reach_m << " mm of '"
           << attach.to << "'; raise reach_mm, or move the bodies";
      Refuse(settings, text.str());
    }
  }
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

void AddStructures(const SceneSettings& settings, const Sheet& sheet, SceneData* scene) {
  for (const StructureSettings& s : settings.structures) {
    if (s.path.size() < 2) {
      Refuse(settings, "a protected structure needs at least two points");
    }
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
      const SheetPoint at = sheet.At(q.x(), q.y());
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

void AddScript(const SceneSettings& settings, const Sheet& sheet, SceneData* scene) {
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
      const SheetPoint at = sheet.At(key.sheet.x(), key.sheet.y());
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

void AddPlannedLine(const SceneSettings& settings, const Sheet& sheet, SceneData* scene) {
  for (std::size_t i = 0; i < settings.planned_line.size(); ++i) {
    const Vec2f& to = settings.planned_line[i];
    const Vec2f& from = settings.planned_line[i > 0 ? i - 1 : 0];
    const int parts = i > 0 ? std::max(1, static_cast<int>(std::ceil((to - from).norm() / kLineStep))) : 1;
    for (int k = 1; k <= parts; ++k) {
      const Vec2f at = from + static_cast<float>(k) / static_cast<float>(parts) * (to - from);
      scene->planned_line.push_back(sheet.At(at.x(), at.y()).material);
    }
  }
}

}  // namespace

SceneData AssembleScene(const SceneSettings& settings, const Anatomy& anatomy) {
  CheckCounts(settings, anatomy);
  SceneData scene;
  SceneView& fixed = scene.fixed;
  std::strncpy(fixed.name, settings.name.c_str(), sizeof(fixed.name) - 1);
  fixed.physics = settings.physics;
  fixed.thermal = settings.thermal;
  fixed.render = settings.render;
  fixed.haptics = settings.haptics;
  fixed.breathing = settings.breathing;
  fixed.assessment = settings.assessment;
  fixed.tools = settings.tools;
  fixed.node_mask = settings.node_mask;
  for (const SolidBody& body : anatomy.solids) fixed.tube_vertex_count += static_cast<Index>(body.vertices.size());
  fixed.membrane.first = fixed.tube_vertex_count;
  fixed.membrane.rows = static_cast<std::uint32_t>(settings.membrane.rows);
  fixed.membrane.cols = static_cast<std::uint32_t>(settings.membrane.cols);

  AddParticles(settings, anatomy, &scene);
  const std::vector<Vec3d> vertices = AddSolids(anatomy, &scene);
  AddMembrane(settings, &scene);
  AddBindings(settings, anatomy, vertices, &scene);
  AddAttachments(settings, anatomy, vertices, &scene);
  scene.membrane_material = MaterialOf(settings, anatomy.sheet);
  AddSurroundings(anatomy, &scene);
  const Sheet sheet(settings.membrane, anatomy.sheet, scene.membrane_material);
  AddStructures(settings, sheet, &scene);
  AddScript(settings, sheet, &scene);
  AddPlannedLine(settings, sheet, &scene);

  const std::size_t n = scene.rest_position.size();
  const auto particles = [](const auto& c) { return ParticlesOf(c); };
  scene.tube_edge_colours = SortByColour(&scene.tube_edges, n, particles);
  scene.bending_colours = SortByColour(&scene.bending, n, particles);
  scene.binding_colours = SortByColour(&scene.bindings, n, particles);
  fixed.hash = ContentHash(scene.View());
  return scene;
}

}  // namespace fulcrum::scene
