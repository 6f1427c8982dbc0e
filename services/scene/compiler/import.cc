#include "services/scene/compiler/import.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/drape.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/placement.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/compiler/tet_repair.h"
#include "services/scene/compiler/tetrahedralise.h"

namespace fulcrum::scene {
namespace {

/// Fewer cannot represent an organ; more exceed the vertices of a scene.
constexpr int kLeastTets = 100, kMostTets = 60000;

/// An organ outside these limits was not given in the unit that the description says.
constexpr double kSmallestOrgan_m = 0.008, kLargestOrgan_m = 1.0;

/// Converts from the files' unit and origin to metres.
template <class Mesh>
Mesh ToMetres(Mesh mesh, const ImportSettings& import, const Vec3f& offset_m) {
  for (Vec3d& p : mesh.vertices) {
    p = import.scale_m * p - import.origin_m.cast<double>() + offset_m.cast<double>();
  }
  return mesh;
}

template <class Mesh>
void Place(const Placement& placement, Mesh* mesh) {
  for (Vec3d& p : mesh->vertices) {
    p = placement.ToWorld(p);
  }
}

void CheckSize(const MeshFile& file, const ImportSettings& import, const std::string& name) {
  const double size = LongestSide(file);
  if (size >= kSmallestOrgan_m && size <= kLargestOrgan_m) return;
  std::string advice = "give its `unit` or a `scale`";
  for (const char* unit : {"m", "cm", "mm", "um"}) {
    const double then = size / import.scale_m * LengthUnit(unit);
    if (then >= kSmallestOrgan_m && then <= kLargestOrgan_m) {
      char text[96];
      std::snprintf(text, sizeof(text), "with `unit: %s` it would be %.3g mm long", unit, 1e3 * then);
      advice = text;
    }
  }
  char text[160];
  std::snprintf(text, sizeof(text), ": the organ is %.3g mm long; valid: %g to %g mm. ", 1e3 * size,
                1e3 * kSmallestOrgan_m, 1e3 * kLargestOrgan_m);
  throw InputError(name + text + advice);
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

Organ FillSurface(const TriangleMesh& read, const ImportSettings& import, const std::string& name,
                  const Progress& progress) {
  RepairReport report;
  Organ organ;
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

Organ ReadOrgan(const ImportSettings& import, const std::string& name, const Progress& progress) {
  MeshFile file = ToMetres(ReadMesh(import.organ_file), import, Vec3f::Zero());
  CheckSize(file, import, name);
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

/// The membrane and what holds the organ beneath it.
struct Membrane {
  std::vector<Vec3d> nodes;
  std::vector<bool> organ_fixed;
  Vec3d cavity_centre;
};

/// Over a stretch of the centre line, beyond which the organ is fixed.
Membrane DrapeAlong(const std::vector<Vec3d>& line, const Vec3d& facing, const SceneSettings& settings,
                    const std::vector<Vec3d>& organ_vertices, const TriangleMesh& surface, const Progress& progress) {
  const ImportSettings& import = *settings.import;
  const CentreLine centre_line(line);
  Membrane membrane;
  for (const Vec3d& p : organ_vertices) {
    const double fraction = centre_line.Project(p);
    membrane.organ_fixed.push_back(fraction < import.from || fraction > import.to);
  }
  membrane.nodes = DrapeMembrane(import, settings.membrane, centre_line, facing, surface, import.organ_file.string());
  membrane.cavity_centre = centre_line.At(0.5 * (import.from + import.to));
  Say(progress, "membrane draped over %.0f mm of the organ", 1e3 * (import.to - import.from) * centre_line.length());
  return membrane;
}

/// Over a patch, whose organ is fixed on the side that faces away.
Membrane DrapeOver(const Placement& placement, const SceneSettings& settings, const std::vector<Vec3d>& organ_vertices,
                   const TriangleMesh& surface, const Progress& progress) {
  // Of the body's height: it lies in a bed that reaches so far up.
  constexpr double kBed = 0.35;
  double low = organ_vertices[0].z(), high = low;
  for (const Vec3d& p : organ_vertices) {
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  Membrane membrane;
  for (const Vec3d& p : organ_vertices) {
    membrane.organ_fixed.push_back(p.z() < low + kBed * (high - low));
  }
  membrane.nodes = DrapePatch(placement.patch_width_m, placement.patch_length_m, settings.membrane, surface,
                              settings.import->organ_file.string());
  membrane.cavity_centre = Vec3d::Zero();
  Say(progress, "membrane draped over a patch of %.0f x %.0f mm", 1e3 * placement.patch_width_m,
      1e3 * placement.patch_length_m);
  return membrane;
}

/// Where the description gives no centre line: along one that is found, or else over a patch.
struct Found {
  Placement placement;
  Membrane membrane;
};

std::optional<Found> FindTube(const SceneSettings& settings, const TriangleMesh& coarse, const Progress& progress) {
  const ImportSettings& import = *settings.import;
  const std::vector<Vec3d> line = FindCentreLine(coarse);
  if (line.empty()) return std::nullopt;
  std::string reason;
  for (const Placement& placement : PlacesOfTube(line, import)) {
    Found found{placement, {}};
    TriangleMesh placed = coarse;
    Place(placement, &placed);
    try {
      found.membrane = DrapeAlong(placement.centre_line, Vec3d::UnitZ(), settings, placed.vertices, placed, {});
      Say(progress, "found a centre line of %.0f mm", 1e3 * CentreLine(placement.centre_line).length());
      return found;
    } catch (const InputError& error) {
      reason = error.what();
    }
  }
  Say(progress, "found a centre line, but no side on which a membrane can be draped along it (%.160s)", reason.c_str());
  return std::nullopt;
}

Found FindMembrane(const SceneSettings& settings, const TriangleMesh& coarse, const Progress& progress) {
  if (!settings.import->patch) {
    if (auto tube = FindTube(settings, coarse, progress)) return *tube;
  }
  Found found{PlacePatch(coarse, *settings.import), {}};
  TriangleMesh placed = coarse;
  Place(found.placement, &placed);
  found.membrane = DrapeOver(found.placement, settings, placed.vertices, placed, progress);
  return found;
}

}  // namespace

Anatomy ImportAnatomy(const SceneSettings& settings, const Progress& progress) {
  ImportSettings import = *settings.import;
  // The membrane's middle will be the origin, and `patch_at_m` is in the frame of the files.
  if (import.centreline_m.empty()) import.origin_m.setZero();
  Organ body = ReadOrgan(import, import.organ_file.string(), progress);
  // Draped over the surface of the tetrahedra, to which the bindings are attached.
  TriangleMesh coarse{body.tets.vertices, BoundaryOf(body.tets.tets)};
  Membrane membrane;
  Placement placement;
  if (!import.centreline_m.empty()) {
    std::vector<Vec3d> line;
    for (const Vec3f& p : import.centreline_m) {
      line.push_back((p - import.origin_m).cast<double>());
    }
    const Vec3f facing = import.facing.value_or(Vec3f::UnitZ());
    membrane = DrapeAlong(line, facing.cast<double>(), settings, body.tets.vertices, coarse, progress);
  } else {
    Found found = FindMembrane(settings, coarse, progress);
    membrane = std::move(found.membrane);
    placement = found.placement;
    // The middle of the membrane becomes the origin, so that tools and scope do not depend on the organ's size.
    const auto middle = static_cast<std::size_t>(settings.membrane.rows / 2) * settings.membrane.cols +
                        static_cast<std::size_t>(settings.membrane.cols / 2);
    const Vec3d shift = membrane.nodes[middle];
    for (Vec3d& p : membrane.nodes) {
      p -= shift;
    }
    membrane.cavity_centre -= shift;
    placement.origin_m += placement.R_WF.transpose() * shift;
    Place(placement, &body.tets);
    Place(placement, &body.surface);
  }
  Anatomy anatomy;
  anatomy.is_patch = placement.patch_width_m > 0;
  anatomy.sheet = std::move(membrane.nodes);
  anatomy.organ_fixed = std::move(membrane.organ_fixed);
  anatomy.organ_vertices = body.tets.vertices;
  anatomy.tets = body.tets.tets;

  TriangleMesh fine = Decimate(body.surface, import.organ_triangles_max);
  anatomy.surface_vertices = std::move(fine.vertices);
  anatomy.surface_triangles = std::move(fine.triangles);

  // A patch ends on the organ, a stretch beside it.
  if (import.bed_m > 0 && !anatomy.is_patch) {
    TriangleMesh bed = ContinueSideways(settings.membrane.rows, settings.membrane.cols, anatomy.sheet, import.bed_m);
    anatomy.surroundings.push_back(
        {"retroperitoneum", SurfaceRole::kRetroperitoneum, true, std::move(bed.vertices), std::move(bed.triangles)});
  }
  if (import.cavity_m > 0) {
    anatomy.surroundings.push_back(Cavity(membrane.cavity_centre, import.cavity_m));
  }
  for (const ImportSettings::Surrounding& s : import.surroundings) {
    TriangleMesh mesh = ToMetres(SurfaceOf(ReadMesh(s.file)), import, s.offset_m);
    Place(placement, &mesh);
    mesh = Decimate(mesh, s.triangles_max);
    Say(progress, "%s: %zu triangles", s.name.c_str(), mesh.triangles.size());
    anatomy.surroundings.push_back({s.name, s.role, s.collides, std::move(mesh.vertices), std::move(mesh.triangles)});
  }
  return anatomy;
}

}  // namespace fulcrum::scene
