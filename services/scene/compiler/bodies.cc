#include "services/scene/compiler/bodies.h"

#include <algorithm>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/drape.h"
#include "services/scene/compiler/fill.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/say.h"
#include "services/scene/compiler/shapes.h"
#include "services/scene/compiler/spot.h"

namespace fulcrum::scene {
namespace {

/// A surface outside these limits was not given in the unit of the description: it would be too small to be seen, or
/// larger than the view.
constexpr double kSmallestFixed_m = 0.001, kLargestFixed_m = 10;

/// Vertices on one side of a body, over a share of its extent in that direction.
std::vector<bool> HeldOn(const std::vector<Vec3d>& vertices, const Vec3d& side, double share) {
  double low = 0, high = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const double at = side.dot(vertices[i]);
    low = i == 0 ? at : std::min(low, at);
    high = i == 0 ? at : std::max(high, at);
  }
  std::vector<bool> held;
  held.reserve(vertices.size());
  for (const Vec3d& p : vertices) held.push_back(side.dot(p) > high - share * (high - low));
  return held;
}

SolidBody Build(const BodySettings& settings, const ImportSettings& like, const Progress& progress) {
  SolidBody body;
  body.name = settings.name;
  body.material = settings.material;
  FilledBody filled;
  if (settings.is_tube) {
    TubeBody tube = TubeOfShape(settings.shape, settings.tet_edge_m);
    filled = {std::move(tube.tets), std::move(tube.surface)};
    for (auto* points : {&filled.tets.vertices, &filled.surface.vertices}) {
      for (Vec3d& p : *points) p -= like.origin_m.cast<double>();
    }
    body.fixed.resize(filled.tets.vertices.size());
    std::fill_n(body.fixed.begin(), tube.ring_vertices, settings.first_end_held);
    std::fill_n(body.fixed.rbegin(), tube.ring_vertices, settings.last_end_held);
  } else {
    ImportSettings import;
    import.scale_m = settings.scale_m > 0 ? settings.scale_m : like.scale_m;
    import.cap_openings = settings.cap_openings;
    import.origin_m = like.origin_m;
    import.organ_file = settings.file;
    import.shape = settings.shape;
    import.tet_edge_m = settings.tet_edge_m;
    filled = FillBody(import, settings.name, progress);
    filled.surface = Decimate(filled.surface, settings.surface_triangles_max);
    body.fixed = settings.held_side
                     ? HeldOn(filled.tets.vertices, settings.held_side->cast<double>(), settings.held_share)
                     : std::vector<bool>(filled.tets.vertices.size());
  }
  for (auto* points : {&filled.tets.vertices, &filled.surface.vertices}) {
    for (Vec3d& p : *points) p += settings.offset_m.cast<double>();
  }
  body.vertices = std::move(filled.tets.vertices);
  body.tets = std::move(filled.tets.tets);
  body.surface_vertices = std::move(filled.surface.vertices);
  body.surface_triangles = std::move(filled.surface.triangles);
  return body;
}

/// build(), with the name in front of a refusal.
template <class Build>
auto Named(const char* what, const std::string& name, const Build& build) {
  try {
    return build();
  } catch (const SpotError&) {
    throw;  // It names the body, and the place to draw.
  } catch (const InputError& error) {
    const std::string text = error.what();
    throw InputError(text.starts_with(name) ? text : std::string(what) + " '" + name + "': " + text);
  }
}

/// Over a patch of a body, as PlacePatch finds it. `origin`: of the frame that `placement` places.
void DrapeOver(const SheetSettings& settings, const Placement& placement, const Vec3d& origin, const Anatomy& anatomy,
               SheetBody* sheet) {
  const auto at = std::ranges::find(anatomy.solids, settings.over, &SolidBody::name);
  if (at == anatomy.solids.end()) throw InputError("over: no body '" + settings.over + "'");
  sheet->over = static_cast<Index>(at - anatomy.solids.begin());
  TriangleMesh surface{at->vertices, BoundaryOf(at->tets)};
  ImportSettings patch;
  patch.patch_width_m = settings.width_m;
  patch.patch_length_m = settings.length_m;
  if (settings.at_m) patch.patch_at_m = placement.ToWorld(settings.at_m->cast<double>() - origin).cast<float>();
  if (settings.facing) patch.facing = (placement.R_WF * settings.facing->cast<double>()).cast<float>();
  const Placement seen = PlacePatch(surface, patch);
  for (Vec3d& p : surface.vertices) p = seen.ToWorld(p);
  sheet->nodes = DrapePatch(seen.patch_width_m, seen.patch_length_m, settings.grid, surface, settings.name);
  for (Vec3d& p : sheet->nodes) p = seen.R_WF.transpose() * p + seen.origin_m;
}

/// Straight from the line of the first row to that of the last one.
void Span(const SheetSettings& settings, const Placement& placement, const Vec3d& origin, SheetBody* sheet) {
  std::array<std::vector<Vec3d>, 2> rows;
  for (std::size_t end = 0; end < 2; ++end) {
    std::vector<Vec3d> points;
    for (const Vec3f& p : settings.between_m[end]) points.push_back(placement.ToWorld(p.cast<double>() - origin));
    const CentreLine line(points);
    for (int c = 0; c < settings.grid.cols; ++c) {
      rows[end].push_back(line.At(static_cast<double>(c) / (settings.grid.cols - 1)));
    }
  }
  for (int r = 0; r < settings.grid.rows; ++r) {
    const double t = static_cast<double>(r) / (settings.grid.rows - 1);
    for (std::size_t c = 0; c < rows[0].size(); ++c) sheet->nodes.push_back((1 - t) * rows[0][c] + t * rows[1][c]);
  }
}

}  // namespace

void AddSheets(const SceneSettings& settings, const Placement& placement, const Progress& progress, Anatomy* anatomy) {
  const Vec3d origin = settings.import.value_or(ImportSettings{}).origin_m.cast<double>();
  for (const SheetSettings& wanted : settings.sheets) {
    SheetBody sheet;
    sheet.name = wanted.name;
    sheet.grid = wanted.grid;
    sheet.ends_held = wanted.ends_held;
    sheet.sides_held = wanted.sides_held;
    sheet.own = wanted.own;
    sheet.heat = wanted.heat;
    Named("sheet", wanted.name, [&] {
      if (wanted.over.empty()) {
        Span(wanted, placement, origin, &sheet);
      } else {
        DrapeOver(wanted, placement, origin, *anatomy, &sheet);
      }
    });
    Say(progress, "%s: %d x %d nodes", sheet.name.c_str(), sheet.grid.rows, sheet.grid.cols);
    anatomy->sheets.push_back(std::move(sheet));
  }
}

void AddFixed(const std::vector<FixedSettings>& surfaces, const SceneSettings& settings, const Placement& placement,
              const Progress& progress, Anatomy* anatomy) {
  const ImportSettings like = settings.import.value_or(ImportSettings{});
  for (const FixedSettings& wanted : surfaces) {
    Named("fixed surface", wanted.name, [&] {
      TriangleMesh mesh;
      if (wanted.file.empty()) {  // Shapes are in metres already.
        mesh = SurfaceOfShape(wanted.shape);
        ToMetres(1, like.origin_m, wanted.offset_m, &mesh.vertices);
      } else {
        const double scale_m = wanted.scale_m > 0 ? wanted.scale_m : like.scale_m;
        MeshFile file = ReadMesh(wanted.file);
        ToMetres(scale_m, like.origin_m, wanted.offset_m, &file.vertices);
        CheckSize(file, scale_m, wanted.name, kSmallestFixed_m, kLargestFixed_m);
        mesh = SurfaceOf(std::move(file));
      }
      for (Vec3d& p : mesh.vertices) p = placement.ToWorld(p);
      mesh = Decimate(mesh, wanted.triangles_max);
      if (wanted.inside) {
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
      }
      Say(progress, "%s: %zu triangles", wanted.name.c_str(), mesh.triangles.size());
      anatomy->surroundings.push_back(
          {wanted.name, wanted.role, wanted.collides, std::move(mesh.vertices), std::move(mesh.triangles)});
    });
  }
}

void AddBodies(const SceneSettings& settings, const Placement& placement, const Progress& progress, Anatomy* anatomy) {
  const ImportSettings like = settings.import.value_or(ImportSettings{});
  for (const BodySettings& wanted : settings.bodies) {
    SolidBody body = Named("body", wanted.name, [&] { return Build(wanted, like, progress); });
    for (auto* points : {&body.vertices, &body.surface_vertices}) {
      for (Vec3d& p : *points) p = placement.ToWorld(p);
    }
    Say(progress, "%s: %zu vertices, %zu tetrahedra", body.name.c_str(), body.vertices.size(), body.tets.size());
    anatomy->solids.push_back(std::move(body));
  }
}

}  // namespace fulcrum::scene
