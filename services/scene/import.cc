#include "services/scene/import.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "services/core/error.h"
#include "services/scene/drape.h"
#include "services/scene/geometry.h"
#include "services/scene/mesh_repair.h"
#include "services/scene/tetrahedralise.h"

namespace fulcrum::scene {
namespace {

/// From the files' unit and origin to frame W.
TriangleMesh ToWorld(TriangleMesh mesh, const ImportSettings& import, const Vec3f& offset_m) {
  for (Vec3d& p : mesh.vertices) {
    p = import.scale_m * p - import.origin_m.cast<double>() + offset_m.cast<double>();
  }
  return mesh;
}

/// A sphere round the stretch under the membrane, its triangles facing inwards.
Anatomy::Surrounding Cavity(const Vec3d& centre, double radius) {
  constexpr int kRows = 25, kCols = 49;
  Anatomy::Surrounding result{"cavity", SurfaceRole::kRetroperitoneum, false, {}, {}};
  for (int r = 0; r < kRows; ++r) {
    // Not quite to the poles, where triangles would have no area.
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

}  // namespace

Anatomy ImportAnatomy(const SceneSettings& settings, const Progress& progress) {
  const ImportSettings& import = *settings.import;
  const std::string name = import.organ_file.string();
  const TriangleMesh read = ToWorld(SurfaceOf(ReadMesh(import.organ_file)), import, Vec3f::Zero());
  Say(progress, "%s: %zu vertices, %zu triangles", name.c_str(), read.vertices.size(), read.triangles.size());
  RepairReport report;
  const TriangleMesh organ = RepairClosedSurface(read, import.min_edge_m, name, &report);
  Say(progress,
      "repaired: %zu edges collapsed, %zu caps flipped, %zu loose pieces dropped, %zu pairs cross; least edge %.2f mm, "
      "least angle %.1f deg",
      report.edges_collapsed, report.caps_flipped, report.pieces_dropped, report.self_intersections,
      1e3 * report.least_edge, report.least_angle_deg);

  Anatomy anatomy;
  TetrahedralMesh tets = Tetrahedralise(organ, import.target_tets, name);
  Say(progress, "filled with %zu tetrahedra, %zu vertices", tets.tets.size(), tets.vertices.size());

  std::vector<Vec3d> line;
  for (const Vec3f& p : import.centreline_m) {
    line.push_back((p - import.origin_m).cast<double>());
  }
  const CentreLine centre_line(line);
  for (const Vec3d& p : tets.vertices) {
    const double fraction = centre_line.Project(p);
    anatomy.organ_fixed.push_back(fraction < import.from || fraction > import.to);
  }
  // Draped over the tetrahedra's own surface: that is what the bindings hold on to.
  const TriangleMesh coarse{tets.vertices, BoundaryOf(tets.tets)};
  anatomy.sheet = DrapeMembrane(import, settings.membrane, centre_line, coarse, name);
  Say(progress, "membrane draped over %.0f mm of the organ", 1e3 * (import.to - import.from) * centre_line.length());
  anatomy.organ_vertices = std::move(tets.vertices);
  anatomy.tets = std::move(tets.tets);

  TriangleMesh fine = Decimate(organ, import.organ_triangles_max);
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
