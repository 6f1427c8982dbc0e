#include "services/scene/compiler/fill.h"

#include <cmath>
#include <cstdio>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/placement.h"
#include "services/scene/compiler/say.h"
#include "services/scene/compiler/shapes.h"
#include "services/scene/compiler/tet_repair.h"
#include "services/scene/compiler/yaml_bodies.h"

namespace fulcrum::scene {
namespace {

/// Fewer cannot represent an organ.
constexpr int kLeastTets = 100;

/// An organ outside these limits was not given in the unit that the description says.
constexpr double kSmallestOrgan_m = 0.008, kLargestOrgan_m = 1.0;

FilledBody TakeTetrahedra(const MeshFile& file, const ImportSettings& import, const std::string& name,
                          const Progress& progress) {
  if (import.wall_m > 0 || import.cap_openings) {
    throw InputError(name +
                     ": wall_mm and cap_openings are for surfaces, but this file holds tetrahedra: remove them, or in "
                     "`organ.import` give `remesh: true`, which takes its surface");
  }
  TetRepairReport report;
  FilledBody organ{RepairTetrahedra(file, name, &report), {}};
  Say(progress,
      "taken: %zu tetrahedra, %zu vertices; %zu vertices merged, %zu turned, %zu doubles and %zu loose pieces dropped; "
      "dihedral angles %.1f to %.1f deg",
      organ.tets.tets.size(), organ.tets.vertices.size(), report.vertices_merged, report.turned, report.doubles_dropped,
      report.pieces_dropped, report.least_dihedral_deg, report.largest_dihedral_deg);
  organ.surface = {organ.tets.vertices, BoundaryOf(organ.tets.tets)};
  return organ;
}

/// Refuses what has no inside: an open sheet under caps, two coincident sheets.
void CheckVolume(const TriangleMesh& surface, const std::string& name) {
  // A ball has 0.094, a plate of 100 x 100 x 1 mm 0.0034.
  constexpr double kLeast = 0.0025;
  const double volume = EnclosedVolume(surface);
  double area = 0;
  for (const Triangle& t : surface.triangles) {
    const Vec3d &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
    area += (b - a).cross(c - a).norm() / 2;
  }
  if (volume > kLeast * std::pow(area, 1.5)) return;
  char text[160];
  std::snprintf(text, sizeof(text),
                ": it encloses %.3g ml within %.3g square centimetres, which is a sheet and no organ", 1e6 * volume,
                1e4 * area);
  throw SpotError(name + text, {{surface}, surface.vertices[0]});
}

/// Fills the surface, or a wrap around it where triangles cross or the mesher fails.
TetrahedralMesh Fill(const TriangleMesh& surface, const RepairReport& report, int target, const std::string& name,
                     const Progress& progress) {
  if (report.self_intersections == 0) {
    try {
      return Tetrahedralise(surface, target, name);
    } catch (const InputError& error) {
      if (report.is_wrapped) throw;
      Say(progress, "not filled (%.120s)", error.what());
    }
  }
  std::size_t dropped = 0;
  const TriangleMesh wrap = WrapSurface(surface, &dropped);
  Say(progress, "wrapped in %zu triangles to be filled", wrap.triangles.size());
  return Tetrahedralise(wrap, target, name);
}

FilledBody FillSurface(const TriangleMesh& read, const ImportSettings& import, const std::string& name,
                       const Progress& progress) {
  RepairReport report;
  FilledBody organ;
  organ.surface = RepairSurface(read, {import.min_edge_m, import.cap_openings, import.wall_m}, name, &report);
  Say(progress,
      "repaired: %zu openings capped, %zu edges collapsed, %zu caps flipped, %zu loose pieces dropped, %zu pairs "
      "cross%s; "
      "least edge %.2f mm, least angle %.1f deg",
      report.openings_capped, report.edges_collapsed, report.caps_flipped, report.pieces_dropped,
      report.self_intersections, report.is_wrapped ? ", wrapped" : "", 1e3 * report.least_edge, report.least_angle_deg);
  CheckVolume(organ.surface, name);
  const int target = import.tet_edge_m > 0 ? TetsOfEdge(organ.surface, import.tet_edge_m) : import.target_tets;
  if (target < kLeastTets || target > kMostTets) {
    throw InputError(name + ": tet_edge_mm = " + std::to_string(1e3 * import.tet_edge_m) + " gives about " +
                     std::to_string(target) + " tetrahedra; valid: " + std::to_string(kLeastTets) + " to " +
                     std::to_string(kMostTets));
  }
  organ.tets = Fill(organ.surface, report, target, name, progress);
  Say(progress, "filled with %zu tetrahedra, %zu vertices", organ.tets.tets.size(), organ.tets.vertices.size());
  return organ;
}

}  // namespace

void CheckSize(const MeshFile& file, double scale_m, const std::string& name, double least_m, double most_m) {
  const double size = LongestSide(file);
  if (size >= least_m && size <= most_m) return;
  std::string advice = "no unit fits: scale the file";
  for (const char* unit : {"um", "cm", "m", "mm"}) {
    const double then = size / scale_m * LengthUnit(unit);
    if (then >= least_m && then <= most_m) {
      char text[96];
      std::snprintf(text, sizeof(text), "with `unit: %s` it would be %.3g mm long", unit, 1e3 * then);
      advice = text;
    }
  }
  char text[160];
  std::snprintf(text, sizeof(text), ": it is %.3g mm long; valid: %g to %g mm. ", 1e3 * size, 1e3 * least_m,
                1e3 * most_m);
  throw InputError(name + text + advice);
}

void ToMetres(double scale_m, const Vec3f& origin_m, const Vec3f& offset_m, std::vector<Vec3d>* points) {
  for (Vec3d& p : *points) {
    p = scale_m * p - origin_m.cast<double>() + offset_m.cast<double>();
  }
}

FilledBody FillBody(const ImportSettings& import, const std::string& name, const Progress& progress) {
  if (import.organ_file.empty()) {
    TriangleMesh surface = SurfaceOfShape(import.shape);
    for (Vec3d& p : surface.vertices) p -= import.origin_m.cast<double>();
    return FillSurface(surface, import, name, progress);
  }
  MeshFile file = ReadMesh(import.organ_file);
  ToMetres(import.scale_m, import.origin_m, Vec3f::Zero(), &file.vertices);
  CheckSize(file, import.scale_m, name, kSmallestOrgan_m, kLargestOrgan_m);
  Say(progress, "%s: %zu vertices, %zu triangles, %zu tetrahedra, %zu points and lines left out", name.c_str(),
      file.vertices.size(), file.triangles.size(), file.tets.size(), file.skipped);
  if (!file.tets.empty() && !import.remesh) {
    try {
      return TakeTetrahedra(file, import, name, progress);
    } catch (const FlawError& flaw) {
      Say(progress, "%.200s: its surface is filled anew", flaw.what());
    }
  }
  return FillSurface(SurfaceOf(std::move(file)), import, name, progress);
}

}  // namespace fulcrum::scene
