#include "physics_node/pbd/printed_solver.h"

#include <algorithm>

#include "physics_node/pbd/printed_formulas.h"
#include "services/base/core/sheets.h"

namespace fulcrum::physics {
namespace {

/// Sums of the triangles' normals at their vertices, as unit vectors; zero where there is no triangle.
std::vector<Vec3f> VertexNormals(std::span<const Vec3f> place, std::span<const Triangle> triangles) {
  std::vector<Vec3f> normals(place.size(), Vec3f::Zero());
  for (const Triangle& t : triangles) {
    const Vec3f area = (place[t[1]] - place[t[0]]).cross(place[t[2]] - place[t[0]]);
    for (const Index v : t) {
      normals[v] += area;
    }
  }
  for (Vec3f& n : normals) {
    n.stableNormalize();
  }
  return normals;
}

}  // namespace

PhysicsParams AsPrinted(PhysicsParams params) {
  params.dt_s = printed::kStep_s;
  params.iterations = printed::kIterations;
  params.damping_per_s = 0;
  params.k_stretch_tube = params.k_stretch_membrane = params.k_binding = printed::kStretch;
  params.k_volume = printed::kVolume;
  params.k_bending = printed::kBending;
  return params;
}

PrintedSolver::PrintedSolver(const TissueScene& scene, const TissueModel* model, ParticleStore* particles)
    : model_(model), particles_(particles), first_node_(scene.membrane.first) {
  const auto refs = [&](const auto& particle) {
    std::array<ParticleRef, 4> at;
    std::transform(particle.begin(), particle.end(), at.begin(), [&](Index p) { return particles->Ref(p); });
    return at;
  };
  for (Index node = 0; node < scene.membrane.node_count(); ++node) {
    nodes_.push_back(particles->Ref(first_node_ + node));
  }
  for (const StretchConstraint& edge : scene.tube_edges) {
    edges_.push_back({{particles->Ref(edge.a), particles->Ref(edge.b)}, edge.rest_length});
  }
  for (const Tetrahedron& tet : scene.tets) {
    const auto at = refs(tet);
    tets_.push_back({at, printed::VolumeOf(Places(at))});
  }
  for (const BendingConstraint& hinge : scene.bending) {
    const auto at = refs(hinge.v);
    hinges_.push_back({at, printed::AngleOf(Places(at))});
  }
  FindLinks(scene);
}

void PrintedSolver::FindLinks(const TissueScene& scene) {
  std::vector<Triangle> sheet;
  for (Index t = 0; t < scene.membrane.triangle_count(); ++t) {
    if (!HasTriangle(scene, t)) continue;
    const std::array<Index, 3> nodes = model_->TriangleNodes(t);
    sheet.push_back({first_node_ + nodes[0], first_node_ + nodes[1], first_node_ + nodes[2]});
  }
  const std::vector<Vec3f> of_sheet = VertexNormals(scene.rest_position, sheet);
  const std::vector<Vec3f> of_organ = VertexNormals(scene.rest_position, scene.tube_surface);
  std::vector<Index> surface;
  for (Index v = 0; v < scene.tube_vertex_count; ++v) {
    if (of_organ[v].squaredNorm() > 0.0f) {
      surface.push_back(v);
    }
  }
  for (Index node = 0; node < scene.membrane.node_count(); ++node) {
    if (model_->IsAbsent(node)) continue;
    const Index particle = first_node_ + node;
    const printed::Vec p = scene.rest_position[particle].cast<double>(), n = of_sheet[particle].cast<double>();
    double least = std::numeric_limits<double>::infinity();
    Index best = 0;
    for (const Index v : surface) {
      const double cost = printed::LinkCost(p, n, scene.rest_position[v].cast<double>(), of_organ[v].cast<double>());
      if (cost < least) {
        least = cost;
        best = v;
      }
    }
    if (std::isfinite(least)) {
      links_.push_back({node, best, (p - scene.rest_position[best].cast<double>()).norm()});
    }
  }
}

template <std::size_t N>
std::array<Eigen::Vector3d, N> PrintedSolver::Places(const std::array<ParticleRef, N>& at) const {
  std::array<Eigen::Vector3d, N> p;
  for (std::size_t i = 0; i < N; ++i) {
    p[i] = particles_->At(at[i]).template cast<double>();
  }
  return p;
}

template <std::size_t N>
std::array<double, N> PrintedSolver::Weights(const std::array<ParticleRef, N>& at) const {
  std::array<double, N> w;
  for (std::size_t i = 0; i < N; ++i) {
    w[i] = static_cast<double>(particles_->InverseMass(at[i]));
  }
  return w;
}

template <std::size_t N>
void PrintedSolver::Put(const std::array<ParticleRef, N>& at, const std::array<Eigen::Vector3d, N>& p) {
  for (std::size_t i = 0; i < N; ++i) {
    particles_->Set(at[i], p[i].template cast<float>());
  }
}

void PrintedSolver::Stretch(const std::array<ParticleRef, 2>& at, double rest) {
  auto p = Places(at);
  printed::ProjectStretch(Weights(at), rest, printed::kStretch, &p);
  Put(at, p);
}

void PrintedSolver::Iterate() {
  for (const Edge& edge : edges_) {
    Stretch(edge.at, edge.rest);
  }
  for (const Four& tet : tets_) {
    auto p = Places(tet.at);
    printed::ProjectVolume(Weights(tet.at), tet.rest, printed::kVolume, &p);
    Put(tet.at, p);
  }
  const Index cols = model_->cols();
  const std::array<Index, 3> next{1, cols, cols + 1};
  for (Index node = 0; node < nodes_.size(); ++node) {
    const std::uint32_t offset = nodes_[node].base - nodes_.front().base;
    for (int direction = 0; direction < 3; ++direction) {
      const float rest = model_->rest(direction)[offset];
      if (rest > 0.0f) {  // 0 where there is no edge, or none left.
        Stretch({nodes_[node], nodes_[node + next[direction]]}, rest);
      }
    }
  }
  for (Index i = 0; i < hinges_.size(); ++i) {
    if (model_->HingeWhole(i)) {
      auto p = Places(hinges_[i].at);
      printed::ProjectBending(Weights(hinges_[i].at), hinges_[i].rest, printed::kBending, &p);
      Put(hinges_[i].at, p);
    }
  }
  for (const Link& link : links_) {
    if (model_->NodeAlive(link.node) && !model_->IsDebris(link.node)) {
      Stretch({nodes_[link.node], particles_->Ref(link.vertex)}, link.rest);
    }
  }
}

}  // namespace fulcrum::physics
