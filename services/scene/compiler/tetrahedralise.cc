#include "services/scene/compiler/tetrahedralise.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polyhedral_mesh_domain_3.h>
#include <CGAL/Random.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/make_mesh_3.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"

namespace fulcrum::scene {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Domain = CGAL::Polyhedral_mesh_domain_3<Surface, Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

constexpr int kAttempts = 6;
/// Bounds of the exponent when the last two attempts do not determine it.
constexpr double kLeastOrder = 1, kLargestOrder = 5;
constexpr double kCountTolerance = 0.1;
constexpr double kLeastShare = 0.6;  ///< Of the count, where no attempt is within the tolerance.
constexpr double kSliverBound_deg = 15;
/// Distance of the mesh from the surface, as a share of the cell size. The fine surface is embedded, so the picture
/// does not depend on this.
constexpr double kFacetDistance = 0.25;
constexpr unsigned kSeed = 0;

TetrahedralMesh ToMesh(const Complex& complex) {
  TetrahedralMesh mesh;
  std::map<std::array<double, 3>, Index> ids;
  const auto key = [](const auto& p) { return std::array<double, 3>{p.x(), p.y(), p.z()}; };
  // Sorted by place: neighbours in memory are neighbours in space, whatever the order of the mesher.
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    for (int k = 0; k < 4; ++k) {
      ids.try_emplace(key(cell->vertex(k)->point().point()), 0);
    }
  }
  std::vector<std::array<double, 3>> places;
  places.reserve(ids.size());
  for (const auto& entry : ids) {
    places.push_back(entry.first);
  }
  std::sort(places.begin(), places.end(), [](const auto& a, const auto& b) {
    return std::array{a[1], a[2], a[0]} < std::array{b[1], b[2], b[0]};
  });
  for (const auto& p : places) {
    ids[p] = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.emplace_back(p[0], p[1], p[2]);
  }
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    Tetrahedron tet;
    for (int k = 0; k < 4; ++k) {
      tet[k] = ids.at(key(cell->vertex(k)->point().point()));
    }
    std::sort(tet.begin(), tet.end());
    const auto& x = mesh.vertices;
    if (SignedVolume(x[tet[0]], x[tet[1]], x[tet[2]], x[tet[3]]) < 0) {
      std::swap(tet[2], tet[3]);
    }
    mesh.tets.push_back(tet);
  }
  std::sort(mesh.tets.begin(), mesh.tets.end());
  return mesh;
}

/// Volume of a regular tetrahedron of edge 1.
const double kRegularVolume = 1 / (6 * std::numbers::sqrt2);

}  // namespace

double EnclosedVolume(const TriangleMesh& surface) {
  double volume = 0;
  for (const Triangle& t : surface.triangles) {
    volume += surface.vertices[t[0]].dot(surface.vertices[t[1]].cross(surface.vertices[t[2]])) / 6;
  }
  return volume;
}

int TetsOfEdge(const TriangleMesh& surface, double edge) {
  return static_cast<int>(std::min(EnclosedVolume(surface) / (kRegularVolume * edge * edge * edge), 1e9));
}

TetrahedralMesh Tetrahedralise(const TriangleMesh& mesh, int target_tets, const std::string& name) {
  namespace params = CGAL::parameters;
  Surface surface;
  std::vector<Surface::Vertex_index> vertices;
  for (const Vec3d& p : mesh.vertices) {
    vertices.push_back(surface.add_vertex({p.x(), p.y(), p.z()}));
  }
  for (const Triangle& t : mesh.triangles) {
    surface.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
  }
  // The criterion bounds circumradii, so the search begins above the edge of the regular tetrahedron.
  double size = 1.1 * std::cbrt(EnclosedVolume(mesh) / (kRegularVolume * target_tets));
  // count ~ size^-order: 3 in a thick body; in a wall of one layer the last two attempts determine it.
  double order = 3, last_size = 0;
  std::size_t last_count = 0;
  Complex nearest;
  double nearest_ratio = 0;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    CGAL::Random random(kSeed);
    CGAL::get_default_random() = CGAL::Random(kSeed);
    const Domain domain(surface, &random);
    const Criteria criteria(params::facet_angle = 25, params::facet_size = size,
                            params::facet_distance = kFacetDistance * size, params::cell_radius_edge_ratio = 2.5,
                            params::cell_size = size);
    // Without a time limit: the mesh must not depend on the clock.
    const Complex complex =
        CGAL::make_mesh_3<Complex>(domain, criteria, params::no_odt(), params::no_lloyd(),
                                   params::perturb(params::time_limit = 0, params::sliver_bound = kSliverBound_deg),
                                   params::exude(params::time_limit = 0, params::sliver_bound = kSliverBound_deg));
    const std::size_t count = complex.number_of_cells_in_complex();
    if (count == 0) {
      break;
    }
    if (last_count > 0) {
      order = std::clamp(
          std::log(static_cast<double>(count) / static_cast<double>(last_count)) / std::log(last_size / size),
          kLeastOrder, kLargestOrder);
    }
    last_count = count;
    last_size = size;
    const double ratio = static_cast<double>(count) / target_tets;
    if (std::abs(ratio - 1) <= kCountTolerance) {
      return ToMesh(complex);
    }
    if (nearest_ratio == 0 || std::abs(std::log(ratio)) < std::abs(std::log(nearest_ratio))) {
      nearest = complex;
      nearest_ratio = ratio;
    }
    size *= std::pow(ratio, 1 / order);
  }
  // In a thin body the count jumps where a layer comes in.
  if (nearest_ratio > kLeastShare && nearest_ratio < 1 / kLeastShare) return ToMesh(nearest);
  throw InputError(name + ": gives " + std::to_string(last_count) + " tetrahedra after " + std::to_string(kAttempts) +
                   " attempts; wanted: " + std::to_string(target_tets) +
                   ". A thin body needs more of them; try another number");
}

}  // namespace fulcrum::scene
