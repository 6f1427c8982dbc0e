#include "services/scene/compiler/import.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/drape.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/tet_repair.h"
#include "services/scene/compiler/tetrahedralise.h"

namespace fulcrum::scene {
namespace {

/// Fewer cannot represent an organ; more exceed the vertices of a scene.
constexpr int kLeastTets = 100, kMostTets = 60000;

/// Converts from the files' unit and origin to frame W.
template <class Mesh>
Mesh ToWorld(Mesh mesh, const ImportSettings& import, const Vec3f& offset_m) {
  for (Vec3d& p : mesh.vertices) {
    p = import.scale_m * p - import.origin_m.cast<double>() + offset_m.cast<double>();
  }
  return mesh;
}

/// A sphere around the stretch under the membrane, its triangles facing inwards.
Anatomy::Surrounding Cavity(const Vec3d& centre, double radius) {
  constexpr int kRows = 25, kCols = 49;
  Anatomy::Surrounding result{"cavity", SurfaceRole::kRetroperitoneum, false, {}, {}};
  for (int r = 0; r < kRows; ++r) {
    // Ends before the poles, where triangles would have no area.
    const double latitude = 0.998 * std::numbers::pi * (static_cast<double>(r) / (kRows - 1) - 0.5);
    for (int c = 0; c < kCols; ++c) {
      const double longitude = -2 * std::numbers::pi * c / (kCols - 1);
      result.vertices.push_back(centre + radius * Vec3d(std::cos(latitude) * std::cos(longitude),
                                                        std::cos(latitude) * std::sin(longitude), std::sin(latitude)));
    }
  }
  result.triangles = GridTriangles(kRows, kCols);
  return result;
}

template <class... Values>
void Say(const Progress& progress, const char* format, Values... values) {
  if (progress) {
    char text[256];
    std::snprintf(text, sizeof(text), format, values...);
    progress(text);
  }
}

/// The organ as a body and its visible surface.
struct Organ {
  TetrahedralMesh tets;
  TriangleMesh surface;
};

Organ TakeTetrahedra(const MeshFile& file, const ImportSettings& import, const std::string& name,
                     const Progress& progress) {
  if (import.wall_m > 0 || import.cap_openings) {
    throw InputError(name +
                     ": wall_mm and cap_openings are for surfaces, but this file holds tetrahedra; with "
                     "`remesh: true` its surface is taken");
  }
  TetRepairReport report;
  Organ organ{RepairTetrahedra(file, name, &report), {}};
  Say(progress,
      "taken: %zu tetrahedra, %zu vertices; %zu vertices merged, %zu turned, %zu doubles and %zu loose pieces dropped; "
      "dihedral angles %.1f to %.1f deg",
      organ.tets.tets.size(), organ.tets.vertices.size(), report.vertices_merged, report.turned, report.doubles_dropped,
      report.pieces_dropped, report.least_dihedral_deg, report.largest_dihedral_deg);
  organ.surface = {organ.tets.vertices, BoundaryOf(organ.tets.tets)};
  return organ;
}

Organ FillSurface(const TriangleMesh& read, const ImportSettings& import, const std::string& name,
                  const Progress& progress) {
  RepairReport report;
  Organ organ;
  organ.surface = RepairSurface(read, {import.min_edge_m, import.cap_openings, import.wall_m}, name, &report);
  Say(progress,
      "repaired: %zu openings capped, %zu edges collapsed, %zu caps flipped, %zu loose pieces dropped, %zu pairs "
      "cross; "
      "least edge %.2f mm, least angle %.1f deg",
      report.openings_capped, report.edges_collapsed, report.caps_flipped, report.pieces_dropped,
      report.self_intersections, 1e3 * report.least_edge, report.least_angle_deg);
  const int target = import.tet_edge_m > 0 ? TetsOfEdge(organ.surface, import.tet_edge_m) : import.target_tets;
  if (target < kLeastTets || target > kMostTets) {
    throw InputError(name + ": tet_edge_mm = " + std::to_string(1e3 * import.tet_edge_m) + " gives about " +
                     std::to_string(target) + " tetrahedra; valid: " + std::to_string(kLeastTets) + " to " +
                     std::to_string(kMostTets));
  }
  organ.tets = Tetrahedralise(organ.surface, target, name);
  Say(progress, "filled with %zu tetrahedra, %zu vertices", organ.tets.tets.size(), organ.tets.vertices.size());
  return organ;
}

Organ ReadOrgan(const ImportSettings& import, const std::string& name, const Progress& progress) {
  MeshFile file = ToWorld(ReadMesh(import.organ_file), import, Vec3f::Zero());
  Say(progress, "%s: %zu vertices, %zu triangles, %zu tetrahedra, %zu points and lines left out", name.c_str(),
      file.vertices.size(), file.triangles.size(), file.tets.size(), file.skipped);
  return file.tets.empty() || import.remesh ? FillSurface(SurfaceOf(std::move(file)), import, name, progress)
                                            : TakeTetrahedra(file, import, name, progress);
}

}  // namespace

Anatomy ImportAnatomy(const SceneSettings& settings, const Progress& progress) {
  const ImportSettings& import = *settings.import;
  const std::string name = import.organ_file.string();
  const Organ body = ReadOrgan(import, name, progress);
  Anatomy anatomy;

  std::vector<Vec3d> line;
  for (const Vec3f& p : import.centreline_m) {
    line.push_back((p - import.origin_m).cast<double>());
  }
  const CentreLine centre_line(line);
  for (const Vec3d& p : body.tets.vertices) {
    const double fraction = centre_line.Project(p);
    anatomy.organ_fixed.push_back(fraction < import.from || fraction > import.to);
  }
  // Draped over the surface of the tetrahedra, to which the bindings are attached.
  const TriangleMesh coarse{body.tets.vertices, BoundaryOf(body.tets.tets)};
  anatomy.sheet = DrapeMembrane(import, settings.membrane, centre_line, coarse, name);
  Say(progress, "membrane draped over %.0f mm of the organ", 1e3 * (import.to - import.from) * centre_line.length());
  anatomy.organ_vertices = body.tets.vertices;
  anatomy.tets = body.tets.tets;

  TriangleMesh fine = Decimate(body.surface, import.organ_triangles_max);
  anatomy.surface_vertices = std::move(fine.vertices);
  anatomy.surface_triangles = std::move(fine.triangles);

  if (import.bed_m > 0) {
    TriangleMesh bed = ContinueSideways(settings.membrane.rows, settings.membrane.cols, anatomy.sheet, import.bed_m);
    anatomy.surroundings.push_back(
        {"retroperitoneum", SurfaceRole::kRetroperitoneum, true, std::move(bed.vertices), std::move(bed.triangles)});
  }
  if (import.cavity_m > 0) {
    anatomy.surroundings.push_back(Cavity(centre_line.At(0.5 * (import.from + import.to)), import.cavity_m));
  }
  for (const ImportSettings::Surrounding& s : import.surroundings) {
    TriangleMesh mesh = Decimate(ToWorld(SurfaceOf(ReadMesh(s.file)), import, s.offset_m), s.triangles_max);
    Say(progress, "%s: %zu triangles", s.name.c_str(), mesh.triangles.size());
    anatomy.surroundings.push_back({s.name, s.role, s.collides, std::move(mesh.vertices), std::move(mesh.triangles)});
  }
  return anatomy;
}

}  // namespace fulcrum::scene
