#include "services/scene/compiler/bodies.h"

#include <algorithm>

#include "services/scene/compiler/fill.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/say.h"
#include "services/scene/compiler/shapes.h"
#include "services/scene/compiler/spot.h"

namespace fulcrum::scene {
namespace {

/// Vertices on one side of a body, over a share of its extent in that direction.
std::vector<bool> HeldOn(const std::vector<Vec3d>& vertices, const Vec3d& side, double share) {
  double low = 0, high = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const double at = side.dot(vertices[i]);
    low = i == 0 ? at : std::min(low, at);
    high = i == 0 ? at : std::max(high, at);
  }
  std::vector<bool> held;
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
    import.scale_m = like.scale_m;
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

/// Build, with the body's name in front of a refusal.
SolidBody BuildNamed(const BodySettings& settings, const ImportSettings& like, const Progress& progress) {
  try {
    return Build(settings, like, progress);
  } catch (const SpotError&) {
    throw;  // It names the body, and the place to draw.
  } catch (const InputError& error) {
    const std::string text = error.what();
    throw InputError(text.starts_with(settings.name) ? text : "body '" + settings.name + "': " + text);
  }
}

}  // namespace

void AddBodies(const SceneSettings& settings, const Placement& placement, const Progress& progress, Anatomy* anatomy) {
  const ImportSettings like = settings.import.value_or(ImportSettings{});
  for (const BodySettings& wanted : settings.bodies) {
    SolidBody body = BuildNamed(wanted, like, progress);
    for (auto* points : {&body.vertices, &body.surface_vertices}) {
      for (Vec3d& p : *points) p = placement.ToWorld(p);
    }
    Say(progress, "%s: %zu vertices, %zu tetrahedra", body.name.c_str(), body.vertices.size(), body.tets.size());
    anatomy->solids.push_back(std::move(body));
  }
}

}  // namespace fulcrum::scene
