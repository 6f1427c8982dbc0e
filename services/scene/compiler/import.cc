#include "services/scene/compiler/import.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/bodies.h"
#include "services/scene/compiler/drape.h"
#include "services/scene/compiler/fill.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/placement.h"
#include "services/scene/compiler/say.h"

namespace fulcrum::scene {
namespace {

/// For messages.
std::string NameOf(const ImportSettings& import) {
  return import.organ_file.empty() ? "organ" : import.organ_file.string();
}

template <class Mesh>
void Place(const Placement& placement, Mesh* mesh) {
  for (Vec3d& p : mesh->vertices) {
    p = placement.ToWorld(p);
  }
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
  membrane.nodes = DrapeMembrane(import, settings.membrane, centre_line, facing, surface, NameOf(import));
  membrane.cavity_centre = centre_line.At(0.5 * (import.from + import.to));
  Say(progress, "membrane draped over %.0f mm of the organ", 1e3 * (import.to - import.from) * centre_line.length());
  return membrane;
}

/// Over a patch, whose organ is fixed on the side that faces away.
Membrane DrapeOver(const Placement& placement, const SceneSettings& settings, const std::vector<Vec3d>& organ_vertices,
                   const TriangleMesh& surface, const Progress& progress) {
  // It lies in a bed that reaches so far up.
  double low = organ_vertices[0].z(), high = low;
  for (const Vec3d& p : organ_vertices) {
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  Membrane membrane;
  for (const Vec3d& p : organ_vertices) {
    membrane.organ_fixed.push_back(p.z() < low + settings.import->held_share * (high - low));
  }
  membrane.nodes = DrapePatch(placement.patch_width_m, placement.patch_length_m, settings.membrane, surface,
                              NameOf(*settings.import));
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

Anatomy ImportAnatomy(const SceneSettings& described, const Progress& progress) {
  SceneSettings settings = described;
  ImportSettings& import = *settings.import;
  // The membrane's middle will be the origin, and `patch_at_m` is in the frame of the files.
  if (import.centreline_m.empty()) import.origin_m.setZero();
  FilledBody body = FillBody(import, NameOf(import), progress);
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
  anatomy.R_WF = placement.R_WF;
  anatomy.origin_m = import.origin_m.cast<double>() + placement.origin_m;
  anatomy.sheets.push_back(MembraneOf(settings, std::move(membrane.nodes)));
  SolidBody organ = OrganOf(settings);
  organ.fixed = std::move(membrane.organ_fixed);
  organ.vertices = body.tets.vertices;
  organ.tets = body.tets.tets;
  TriangleMesh fine = Decimate(body.surface, import.organ_triangles_max);
  organ.surface_vertices = std::move(fine.vertices);
  organ.surface_triangles = std::move(fine.triangles);
  anatomy.solids.push_back(std::move(organ));
  AddBodies(settings, placement, progress, &anatomy);
  AddSheets(settings, placement, progress, &anatomy);

  // A patch ends on the organ, a stretch beside it.
  if (import.bed_m > 0 && !anatomy.is_patch) {
    TriangleMesh bed =
        ContinueSideways(settings.membrane.rows, settings.membrane.cols, anatomy.sheets[0].nodes, import.bed_m);
    anatomy.surroundings.push_back(
        {"retroperitoneum", SurfaceRole::kRetroperitoneum, true, std::move(bed.vertices), std::move(bed.triangles)});
  }
  if (import.cavity_m > 0) {
    anatomy.surroundings.push_back(Cavity(membrane.cavity_centre, import.cavity_m));
  }
  AddFixed(import.surroundings, settings, placement, progress, &anatomy);
  AddFixed(settings.fixed, settings, placement, progress, &anatomy);
  return anatomy;
}

}  // namespace fulcrum::scene
