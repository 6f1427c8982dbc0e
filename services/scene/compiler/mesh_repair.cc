#include "services/scene/compiler/mesh_repair.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <CGAL/alpha_wrap_3.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

#include "services/base/core/error.h"

namespace fulcrum::scene {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

/// A triangle with an angle larger than this is a cap: nearly flat, its height far below its edges.
const double kCapCosine = std::cos(165 * std::numbers::pi / 180);

Surface ToSurface(const TriangleMesh& mesh) {
  std::vector<Kernel::Point_3> points;
  for (const Vec3d& p : mesh.vertices) {
    points.emplace_back(p.x(), p.y(), p.z());
  }
  std::vector<std::vector<std::size_t>> polygons;
  for (const Triangle& t : mesh.triangles) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      polygons.push_back({t[0], t[1], t[2]});
    }
  }
  // Merges duplicate points and triangles, drops triangles without area, makes the orientation of neighbours consistent
  // and splits vertices where that is impossible.
  pmp::repair_polygon_soup(points, polygons);
  pmp::orient_polygon_soup(points, polygons);
  Surface surface;
  pmp::polygon_soup_to_polygon_mesh(points, polygons, surface);
  pmp::stitch_borders(surface);
  return surface;
}

TriangleMesh ToMesh(Surface* surface) {
  surface->collect_garbage();
  TriangleMesh mesh;
  for (const auto v : surface->vertices()) {
    const auto& p = surface->point(v);
    mesh.vertices.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : surface->faces()) {
    Triangle triangle;
    int k = 0;
    for (const auto v : surface->vertices_around_face(surface->halfedge(f))) {
      triangle[k++] = static_cast<Index>(v.idx());
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

void MeasureShape(const TriangleMesh& mesh, RepairReport* report) {
  report->least_edge = 1e300;
  report->least_angle_deg = 180;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const Vec3d a = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]];
      const Vec3d b = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[t[k]];
      report->least_edge = std::min(report->least_edge, a.norm());
      report->least_angle_deg =
          std::min(report->least_angle_deg, std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi);
    }
  }
}

double SquaredLength(const Surface& surface, Surface::Edge_index e) {
  return CGAL::squared_distance(surface.point(surface.vertex(e, 0)), surface.point(surface.vertex(e, 1)));
}

/// Collapses an edge to its middle, unless that would change the topology or turn a neighbouring triangle over.
bool Collapse(Surface::Edge_index e, Surface* surface) {
  if (!CGAL::Euler::does_satisfy_link_condition(e, *surface)) {
    return false;
  }
  const auto h = surface->halfedge(e);
  const auto a = surface->source(h), b = surface->target(h);
  const Kernel::Point_3 middle = CGAL::midpoint(surface->point(a), surface->point(b));
  for (const auto v : {a, b}) {
    for (const auto f : surface->faces_around_target(surface->halfedge(v))) {
      std::array<Kernel::Point_3, 3> before, after;
      int k = 0;
      int ends = 0;
      for (const auto w : surface->vertices_around_face(surface->halfedge(f))) {
        const bool moves = w == a || w == b;
        ends += moves ? 1 : 0;
        before[k] = surface->point(w);
        after[k++] = moves ? middle : surface->point(w);
      }
      // CGAL::normal requires triangles with an area.
      const auto n0 = CGAL::cross_product(before[1] - before[0], before[2] - before[0]);
      const auto n1 = CGAL::cross_product(after[1] - after[0], after[2] - after[0]);
      const bool had_area = n0.squared_length() > 0;
      if (ends == 1 && had_area && n0 * n1 <= 0) {
        return false;
      }
    }
  }
  surface->point(CGAL::Euler::collapse_edge(e, *surface)) = middle;
  return true;
}

/// Flips the longest edge of a cap (a triangle with an angle near 180 degrees) when the flip is possible.
bool FlipCap(Surface::Face_index f, Surface* surface) {
  const auto h = pmp::is_cap_triangle_face(f, *surface, kCapCosine);
  if (h == Surface::null_halfedge() || surface->is_border(surface->edge(h))) {
    return false;
  }
  const auto opposite = surface->target(surface->next(surface->opposite(h)));
  const auto own = surface->target(surface->next(h));
  if (own == opposite || surface->halfedge(own, opposite) != Surface::null_halfedge()) {
    return false;
  }
  CGAL::Euler::flip_edge(h, *surface);
  return true;
}

/// Collapses short edges, shortest first, then flips caps; repeats until nothing changes.
void RemoveSlivers(double min_edge, Surface* surface, RepairReport* report) {
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    bool changed = false;
    std::vector<std::pair<double, Surface::Edge_index>> edges;
    for (const auto e : surface->edges()) {
      if (SquaredLength(*surface, e) < min_edge * min_edge) {
        edges.emplace_back(SquaredLength(*surface, e), e);
      }
    }
    std::sort(edges.begin(), edges.end());
    for (const auto& [length, e] : edges) {
      if (!surface->is_removed(e) && SquaredLength(*surface, e) < min_edge * min_edge && Collapse(e, surface)) {
        ++report->edges_collapsed;
        changed = true;
      }
    }
    surface->collect_garbage();
    for (const auto f : surface->faces()) {
      if (FlipCap(f, surface)) {
        ++report->caps_flipped;
        changed = true;
      }
    }
    if (!changed) {
      return;
    }
  }
}

/// Fewer triangles than these are enough for any organ; more only take time.
void Thin(Surface* surface) {
  constexpr std::size_t kMany = 120000, kEnough = 60000;
  if (surface->number_of_faces() > kMany) {
    sms::edge_collapse(*surface, sms::Count_stop_predicate<Surface>(kEnough * 3 / 2));
    surface->collect_garbage();
  }
}

/// "72 open edges in 2 openings, the longest around (1, 2, 3) mm", in the frame of the organ.
std::string OpeningsOf(const Surface& surface, Vec3d* place) {
  std::vector<Surface::Halfedge_index> cycles;
  pmp::extract_boundary_cycles(surface, std::back_inserter(cycles));
  std::size_t edges = 0, longest = 0;
  for (const auto start : cycles) {
    std::size_t count = 0;
    Vec3d sum = Vec3d::Zero();
    auto h = start;
    do {
      const auto& p = surface.point(surface.target(h));
      sum += Vec3d(p.x(), p.y(), p.z());
      ++count;
      h = surface.next(h);
    } while (h != start);
    edges += count;
    if (count > longest) {
      longest = count;
      *place = sum / static_cast<double>(count);
    }
  }
  char text[160];
  std::snprintf(text, sizeof(text), "%zu open edges in %zu opening%s, the longest around (%.3g, %.3g, %.3g) mm", edges,
                cycles.size(), cycles.size() == 1 ? "" : "s", 1e3 * place->x(), 1e3 * place->y(), 1e3 * place->z());
  return text;
}

/// Closes every hole with triangles between its own vertices. Returns the number of holes closed.
std::size_t CapOpenings(Surface* surface) {
  std::vector<Surface::Halfedge_index> holes;
  pmp::extract_boundary_cycles(*surface, std::back_inserter(holes));
  std::size_t capped = 0;
  for (const auto h : holes) {
    std::vector<Surface::Face_index> faces;
    pmp::triangulate_hole(*surface, h, std::back_inserter(faces));
    capped += faces.empty() ? 0 : 1;
  }
  return capped;
}

/// Orients the surface outward, also if it is open: as the body that caps would close.
void OrientOutward(const std::string& name, Surface* surface) {
  Surface closed = *surface;
  CapOpenings(&closed);
  if (!CGAL::is_closed(closed)) {
    throw InputError(name + ": its openings cannot be closed, so that its inner side is not known");
  }
  if (pmp::volume(closed) < 0) {
    pmp::reverse_face_orientations(*surface);
  }
}

/// The outer surface, an inner one below it by `thickness`, and rims between the two where it is open.
TriangleMesh WithWall(const TriangleMesh& outer, double thickness) {
  // Smoothing steps of the normals: with the noise of the surface the inner side would intersect itself.
  constexpr int kSmoothing = 3;
  const std::size_t count = outer.vertices.size();
  // Weighted by the angle at the vertex, so that the result does not depend on the triangulation.
  const auto angle = [&](const Triangle& t, std::size_t k) {
    const Vec3d &p = outer.vertices[t[k]], a = outer.vertices[t[(k + 1) % 3]] - p,
                b = outer.vertices[t[(k + 2) % 3]] - p;
    return std::atan2(a.cross(b).norm(), a.dot(b));
  };
  std::vector<Vec3d> normals(count, Vec3d::Zero());
  for (const Triangle& t : outer.triangles) {
    const Vec3d& p = outer.vertices[t[0]];
    const Vec3d normal = (outer.vertices[t[1]] - p).cross(outer.vertices[t[2]] - p).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      normals[t[k]] += angle(t, k) * normal;
    }
  }
  for (int round = 0; round < kSmoothing; ++round) {
    std::vector<Vec3d> sums(count, Vec3d::Zero());
    for (const Triangle& t : outer.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        sums[t[k]] += angle(t, k) * (2 * normals[t[k]].normalized() + normals[t[(k + 1) % 3]].normalized() +
                                     normals[t[(k + 2) % 3]].normalized());
      }
    }
    normals = sums;
  }
  TriangleMesh wall = outer;
  for (std::size_t v = 0; v < count; ++v) {
    wall.vertices.push_back(outer.vertices[v] - thickness * normals[v].normalized());
  }
  const auto shift = static_cast<Index>(count);
  std::set<std::array<Index, 2>> edges;
  for (const Triangle& t : outer.triangles) {
    wall.triangles.push_back({t[0] + shift, t[2] + shift, t[1] + shift});
    for (std::size_t k = 0; k < 3; ++k) {
      edges.insert({t[k], t[(k + 1) % 3]});
    }
  }
  for (const auto& [a, b] : edges) {
    if (!edges.contains({b, a})) {
      wall.triangles.push_back({b, a, a + shift});
      wall.triangles.push_back({b, a + shift, b + shift});
    }
  }
  return wall;
}

/// Share of the area that one piece must have to stand for the whole file.
constexpr double kMainPiece = 0.7;

TriangleMesh Wrapped(const TriangleMesh& mesh, RepairReport* report) {
  report->is_wrapped = true;
  TriangleMesh wrap = WrapSurface(mesh, &report->pieces_dropped);
  MeasureShape(wrap, report);
  return wrap;
}

}  // namespace

TriangleMesh WrapSurface(const TriangleMesh& mesh, std::size_t* pieces_dropped) {
  // Details and openings smaller than this share of the box's diagonal disappear, and the wrap lies outside by a
  // twentieth of that.
  constexpr double kShare = 1.0 / 80, kOffsetShare = 0.05;
  Vec3d low = Vec3d::Constant(1e300), high = -low;
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    for (const Index v : t) {
      low = low.cwiseMin(mesh.vertices[v]);
      high = high.cwiseMax(mesh.vertices[v]);
    }
    const Vec3d& a = mesh.vertices[t[0]];
    area += (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
  }
  if (!(area > 0)) throw InputError("no triangle has an area");
  std::vector<Kernel::Point_3> points;
  for (const Vec3d& p : mesh.vertices) points.emplace_back(p.x(), p.y(), p.z());
  const double alpha = kShare * (high - low).norm();
  Surface wrap;
  CGAL::alpha_wrap_3(points, mesh.triangles, alpha, kOffsetShare * alpha, wrap);
  *pieces_dropped = pmp::keep_largest_connected_components(wrap, 1);
  return ToMesh(&wrap);
}

TriangleMesh RepairSurface(const TriangleMesh& mesh, const SurfaceRepair& settings, const std::string& name,
                           RepairReport* report) {
  Surface surface = ToSurface(mesh);
  if (surface.number_of_faces() == 0) {
    throw InputError(name + ": no triangle with an area");
  }
  Thin(&surface);
  const double whole = pmp::area(surface);
  Surface all = surface;
  report->pieces_dropped = pmp::keep_largest_connected_components(surface, 1);
  surface.collect_garbage();
  // Parts that overlap or triangles that do not meet are one body only when they are wrapped.
  const bool is_piecemeal = pmp::area(surface) < kMainPiece * whole;
  if (is_piecemeal && !(settings.wall > 0)) return Wrapped(ToMesh(&all), report);
  if (settings.cap_openings) {
    report->openings_capped = CapOpenings(&surface);
  }
  if (!CGAL::is_closed(surface) && !(settings.wall > 0)) {
    if (settings.cap_openings) return Wrapped(ToMesh(&surface), report);
    Spot spot;
    const std::string openings = OpeningsOf(surface, &spot.place);
    spot.meshes = {ToMesh(&surface)};
    throw OpenSurfaceError(name + ": the surface is not closed (" + openings +
                               "); `cap_openings: true` closes its holes; in `organ.import`, `wall_mm` makes it a wall",
                           std::move(spot));
  }
  RemoveSlivers(settings.min_edge, &surface, report);
  OrientOutward(name, &surface);
  if (settings.wall > 0) {
    surface = ToSurface(WithWall(ToMesh(&surface), settings.wall));
  }
  std::vector<std::pair<Surface::Face_index, Surface::Face_index>> crossing;
  pmp::self_intersections(surface, std::back_inserter(crossing));
  report->self_intersections = crossing.size();
  if (settings.wall > 0 && !crossing.empty()) {
    throw InputError(name + ": the wall's inner side crosses itself (" + std::to_string(crossing.size()) +
                     " pairs of triangles); choose a thinner wall, or a smoother or coarser surface");
  }
  if (!CGAL::is_closed(surface) || !CGAL::is_valid_polygon_mesh(surface)) {
    if (!(settings.wall > 0)) return Wrapped(ToMesh(&surface), report);
    throw InputError(name + ": cannot be repaired to a closed surface");
  }
  TriangleMesh repaired = ToMesh(&surface);
  MeasureShape(repaired, report);
  return repaired;
}

TriangleMesh Decimate(const TriangleMesh& mesh, int triangles_max) {
  Surface surface = ToSurface(mesh);
  const auto wanted_edges = static_cast<std::size_t>(triangles_max) * 3 / 2;
  if (surface.number_of_faces() > static_cast<std::size_t>(triangles_max)) {
    sms::edge_collapse(surface, sms::Count_stop_predicate<Surface>(wanted_edges));
  }
  return ToMesh(&surface);
}

}  // namespace fulcrum::scene
