// Setup of TissueCollision: watches of the membrane against the organ, of both against the fixed surfaces.
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "physics_node/collision/tissue_collision.h"
#include "services/base/core/breathing.h"
#include "services/base/core/solids.h"

namespace fulcrum::physics {
namespace {

/// Range of the search for the organ from the membrane at rest: contains every scene [m].
constexpr float kRestRange = 1.0f;
/// Of several solids, those are watched whose box is nearer than this at rest: what something holds moves less than
/// that towards them [m]. A solid without a fixed vertex can come from anywhere.
constexpr float kSolidRange = 0.06f;

/// Surface triangles of one solid in the rest shape.
struct SolidSurface {
  TriangleTree tree;
  std::vector<Index> triangles;  ///< Of tube_surface, by triangle of the tree.
  Eigen::AlignedBox3f box;
  bool held = false;
};

std::vector<SolidSurface> SurfacesOf(const TissueScene& scene, const std::vector<Index>& solid) {
  std::vector<SolidSurface> surfaces(SolidCount(scene));
  std::vector<std::vector<std::array<Vec3f, 3>>> corners(surfaces.size());
  for (Index t = 0; t < scene.tube_surface.size(); ++t) {
    const Triangle& v = scene.tube_surface[t];
    SolidSurface& surface = surfaces[solid[v[0]]];
    surface.triangles.push_back(t);
    for (const Index vertex : v) {
      surface.box.extend(scene.rest_position[vertex]);
      surface.held = surface.held || scene.inverse_mass[vertex] == 0.0f;
    }
    corners[solid[v[0]]].push_back({scene.rest_position[v[0]], scene.rest_position[v[1]], scene.rest_position[v[2]]});
  }
  for (std::size_t i = 0; i < surfaces.size(); ++i) surfaces[i].tree = TriangleTree(std::move(corners[i]));
  return surfaces;
}

}  // namespace

void TissueCollision::Watches::MakeGroups(const ParticleStore& particles) {
  for (Index i = 0; i < all.size(); ++i) {
    const Index block = particles.BlockOf(all[i].particle);
    if (groups.empty() || groups.back().block != block) {
      groups.push_back({.travel = 0, .times = {}, .block = block});
      first.push_back(i);
    }
  }
  first.push_back(static_cast<Index>(all.size()));
  times.resize(all.size());
}

/// Membrane against each solid, and the surface of each solid against the others.
void TissueCollision::WatchOrgan() {
  std::vector<std::vector<Index>> around(scene_.tube_vertex_count);
  for (Index t = 0; t < scene_.tube_surface.size(); ++t) {
    for (const Index vertex : scene_.tube_surface[t]) {
      around[vertex].push_back(t);
    }
  }
  ring_start_.push_back(0);
  for (Index t = 0; t < scene_.tube_surface.size(); ++t) {
    std::vector<Index> ring;
    for (const Index vertex : scene_.tube_surface[t]) {
      ring.insert(ring.end(), around[vertex].begin(), around[vertex].end());
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    std::erase(ring, t);
    ring.insert(ring.begin(), t);
    ring_.insert(ring_.end(), ring.begin(), ring.end());
    ring_start_.push_back(static_cast<Index>(ring_.size()));
  }
  const std::vector<Index> solid = SolidOfVertices(scene_);
  const std::vector<SolidSurface> surfaces = SurfacesOf(scene_, solid);
  std::vector<Index> guess(surfaces.size(), kNoIndex);
  const auto watch_from = [&](Index particle, Index own) {
    const Vec3f& p = scene_.rest_position[particle];
    for (Index i = 0; i < surfaces.size(); ++i) {
      const SolidSurface& surface = surfaces[i];
      const bool is_loose = !surface.held || (own != kNoIndex && !surfaces[own].held);
      const bool is_near = surfaces.size() == 1 || is_loose || surface.box.exteriorDistance(p) < kSolidRange;
      if (i == own || surface.tree.empty() || !is_near) continue;
      const TriangleTree::Hit hit = surface.tree.Nearest(p, kRestRange, guess[i]);
      guess[i] = hit.triangle;
      if (hit.triangle == kNoIndex || !(scene_.inverse_mass[particle] > 0.0f)) continue;
      const Index triangle = surface.triangles[hit.triangle];
      const Triangle& v = scene_.tube_surface[triangle];
      const float rest =
          SignedDistance(p, {scene_.rest_position[v[0]], scene_.rest_position[v[1]], scene_.rest_position[v[2]]})
              .distance;
      if (!(rest > 0.0f)) continue;
      Watch watch;
      watch.particle = particle;
      watch.at = particles_->Ref(particle);
      watch.triangle = triangle;
      watch.clearance = std::min(scene_.physics.collision_margin_m, kRestShare * rest);
      watch.SetGap(rest - watch.clearance, RelativePlace(watch), 0.0f);
      organ_.all.push_back(watch);
    }
  };
  for (Index vertex = 0; vertex < scene_.tube_vertex_count && surfaces.size() > 1; ++vertex) {
    if (!around[vertex].empty()) watch_from(vertex, solid[vertex]);
  }
  for (Index node = 0; node < scene_.membrane.node_count(); ++node) {
    watch_from(scene_.membrane.first + node, kNoIndex);
  }
  organ_.MakeGroups(*particles_);
  organ_moved_of_.assign(std::size_t{particles_->tube_blocks()} + 1, 0.0f);
  organ_.organ_blocks.resize(organ_.groups.size());
  for (Index group = 0; group < organ_.groups.size(); ++group) {
    FindOrganBlocks(group);
  }
}

void TissueCollision::WatchFixed(const StaticSurface& surface) {
  std::vector<std::array<Vec3f, 3>> corners;
  for (Index t = surface.first_triangle; t < surface.first_triangle + surface.triangle_count; ++t) {
    const Triangle& v = scene_.static_triangles[t];
    corners.push_back({scene_.static_vertices[v[0]], scene_.static_vertices[v[1]], scene_.static_vertices[v[2]]});
  }
  Fixed fixed;
  fixed.tree = TriangleTree(std::move(corners));
  fixed.breathes = scene_.breathing.amplitude_m > 0.0f && Breathes(surface.role);
  std::vector<bool> on_surface(particles_->particle_count(), false);
  for (const Triangle& t : scene_.tube_surface) {
    on_surface[t[0]] = on_surface[t[1]] = on_surface[t[2]] = true;
  }
  for (Index particle = 0; particle < particles_->particle_count(); ++particle) {
    if (!(scene_.inverse_mass[particle] > 0.0f) || (particle < scene_.tube_vertex_count && !on_surface[particle])) {
      continue;
    }
    Watch watch;
    watch.particle = particle;
    watch.at = particles_->Ref(particle);
    const Vec3f& rest = scene_.rest_position[particle];
    watch.SetGap(EvaluateFixedGap(fixed.tree, rest, &watch), rest, 0.0f);
    if (!watch.behind) {
      fixed.watches.all.push_back(watch);
    }
  }
  fixed.watches.MakeGroups(*particles_);
  fixed_.push_back(std::move(fixed));
}

}  // namespace fulcrum::physics
