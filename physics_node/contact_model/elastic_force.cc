#include "physics_node/contact_model/elastic_force.h"

#include <algorithm>
#include <map>

#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"

namespace fulcrum::physics {
namespace {

/// Stiffness factors for which the springs along the edges of a triangle or tetrahedron store the energy of the
/// continuum under uniaxial strain e, averaged over directions: mean cos^4 = 3/8 in the plane and 1/5 in space.
/// Triangle: E t e^2 A / 2 = 3 (k L^2 e^2 / 2) 3/8. Tetrahedron: E e^2 V / 2 = 6 (k L^2 e^2 / 2) / 5.
constexpr double kTriangleShare = 8.0 / 9.0;
constexpr double kTetShare = 5.0 / 6.0;

/// Least mean length of a binding in the stiffness of the fat [m]; as kLeastBindingLength of ElasticModel.
constexpr double kLeastFatLength = 1e-3;

}  // namespace

ElasticForce::ElasticForce(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene), model_(model), particles_(particles) {
  const auto x = [&](Index p) { return Vec3d(scene.rest_position[p].cast<double>()); };
  const Index first = scene.membrane.first, cols = scene.membrane.cols;
  membrane_stiffness_.assign(3 * std::size_t{scene.membrane.node_count()}, 0.0f);
  const std::vector<std::size_t> sheet = SheetOfRows(scene);
  std::vector<double> sheet_area(sheet.empty() ? 0 : sheet.back() + 1);
  const std::vector<SheetProperties> properties = PropertiesOfRows(scene);
  for (Index t = 0; t < scene.membrane.triangle_count(); ++t) {
    if (!HasTriangle(scene, t)) continue;
    const auto n = model->TriangleNodes(t);
    const double area = 0.5 * (x(first + n[1]) - x(first + n[0])).cross(x(first + n[2]) - x(first + n[0])).norm();
    sheet_area[sheet[n[0] / cols]] += area;
    for (int i = 0; i < 3; ++i) {
      const Index a = std::min(n[i], n[(i + 1) % 3]), b = std::max(n[i], n[(i + 1) % 3]);
      const Index edge = 3 * a + (b - a == 1 ? 0u : b - a == cols ? 1u : 2u);
      const double length_sq = (x(first + b) - x(first + a)).squaredNorm();
      membrane_stiffness_[edge] +=
          static_cast<float>(kTriangleShare * properties[n[0] / cols].Et_N_per_m * area / length_sq);
    }
  }
  const std::vector<Index> solid = SolidOfVertices(scene);
  std::map<std::pair<Index, Index>, double> tube;
  for (const Tetrahedron& t : scene.tets) {
    const double volume = (x(t[1]) - x(t[0])).cross(x(t[2]) - x(t[0])).dot(x(t[3]) - x(t[0])) / 6.0;
    for (int i = 0; i < 4; ++i) {
      for (int j = i + 1; j < 4; ++j) {
        tube[std::minmax(t[i], t[j])] += kTetShare * static_cast<double>(YoungsModulusOf(scene, solid[t[0]])) * volume /
                                         (x(t[i]) - x(t[j])).squaredNorm();
      }
    }
  }
  std::vector<std::vector<TubeEdge>> rows(scene.tube_vertex_count);
  for (const StretchConstraint& edge : scene.tube_edges) {
    const auto at = tube.find(std::minmax(edge.a, edge.b));
    const float k = at == tube.end() ? 0.0f : static_cast<float>(at->second);
    rows[edge.a].push_back({edge.b, edge.rest_length, k});
    rows[edge.b].push_back({edge.a, edge.rest_length, k});
  }
  tube_start_.push_back(0);
  for (const auto& row : rows) {
    tube_edges_.insert(tube_edges_.end(), row.begin(), row.end());
    tube_start_.push_back(static_cast<Index>(tube_edges_.size()));
  }
  if (!scene.bindings.empty()) {
    // Each binding is a column of fat with its share of the sheet as cross section and the mean length of all bindings.
    std::vector<double> length(sheet_area.size()), count(sheet_area.size());
    for (const Binding& binding : scene.bindings) {
      const std::size_t of = sheet[(binding.membrane - first) / cols];
      length[of] += binding.rest_length;
      count[of] += 1;
    }
    for (std::size_t row = 0; row < sheet.size(); ++row) {
      const std::size_t of = sheet[row];
      const double n = std::max(count[of], 1.0);
      binding_stiffness_.push_back(
          static_cast<float>(static_cast<double>(properties[row].fat_youngs_modulus_Pa) * (sheet_area[of] / n) /
                             std::max(length[of] / n, kLeastFatLength)));
    }
  }
}

/// visit(other particle, rest length, stiffness) for the live edges of a particle.
template <class Visit>
void ElasticForce::ForEachNeighbour(Index particle, const Visit& visit) const {
  if (particle < scene_.tube_vertex_count) {
    for (Index i = tube_start_[particle]; i < tube_start_[particle + 1]; ++i) {
      visit(tube_edges_[i].other, tube_edges_[i].rest, tube_edges_[i].stiffness);
    }
    return;
  }
  const Index first = scene_.membrane.first, cols = scene_.membrane.cols, node = particle - first;
  const GridLayout& layout = particles_->layout();
  const Index row = node / cols, col = node % cols;
  const auto edge = [&](Index from, int direction, Index other) {
    const float rest = model_->rest(direction)[layout.Offset(from / cols, from % cols)];
    if (rest > 0.0f) {
      visit(first + other, rest, membrane_stiffness_[3 * from + static_cast<Index>(direction)]);
    }
  };
  constexpr std::array<std::array<Index, 2>, 3> kStep{{{0, 1}, {1, 0}, {1, 1}}};
  for (int d = 0; d < 3; ++d) {
    const auto [dr, dc] = kStep[static_cast<std::size_t>(d)];
    const Index apart = dr * cols + dc;
    if (row + dr < scene_.membrane.rows && col + dc < cols) {
      edge(node, d, node + apart);
    }
    if (row >= dr && col >= dc) {
      edge(node - apart, d, node - apart);
    }
  }
}

Vec3f ElasticForce::OnParticle(Index particle) const {
  const Vec3f here = particles_->At(particles_->Ref(particle));
  const bool membrane = particle >= scene_.tube_vertex_count;
  Vec3f force = Vec3f::Zero();
  ForEachNeighbour(particle, [&](Index other, float rest, float stiffness) {
    const Vec3f d = particles_->At(particles_->Ref(other)) - here;
    const float length = d.norm();
    // A thin sheet buckles under pressure: its edges only pull.
    if (length > rest || (!membrane && length > 0.0f)) {
      const float strain = membrane ? length / rest - 1.0f : 0.0f;
      const float stiffer = 1.0f + scene_.physics.membrane_stiffening * strain * strain;
      force += (stiffness * stiffer * (length - rest) / length) * d;
    }
  });
  if (membrane) {
    const Index node = particle - scene_.membrane.first;
    if (const auto binding = model_->BindingOf(node)) {
      Vec3f foot = Vec3f::Zero();
      for (std::size_t i = 0; i < 3; ++i) {
        foot += binding->barycentric[i] * particles_->At(binding->surface[i]);
      }
      const Vec3f d = foot - here;
      const float length = d.norm();
      if (length > 0.0f) {
        force += (binding_stiffness_[node / scene_.membrane.cols] * (length - binding->rest_length) / length) * d;
      }
    }
  }
  return force;
}

Vec3f ElasticForce::OnSet(std::span<const Index> set) const {
  Vec3f force = Vec3f::Zero();
  for (const Index particle : set) {
    force += OnParticle(particle);
  }
  return force;
}

float ElasticForce::StiffnessAround(std::span<const Index> set) const {
  float sum = 0;
  for (const Index particle : set) {
    ForEachNeighbour(particle, [&](Index other, float, float stiffness) {
      if (!std::binary_search(set.begin(), set.end(), other)) {
        sum += stiffness;
      }
    });
  }
  return sum;
}

}  // namespace fulcrum::physics
