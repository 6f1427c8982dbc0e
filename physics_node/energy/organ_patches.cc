// Nodal patches of the organ and the variance term of its energy (elastic_model.h), summed over the tetrahedra.
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "physics_node/energy/elastic_model.h"

namespace fulcrum::physics {
namespace {

/// By vertex: does it lie on a face that only one tetrahedron has?
std::vector<bool> OnSurface(const std::vector<ElasticTet>& tets, std::size_t vertices) {
  std::vector<Triangle> faces;
  faces.reserve(4 * tets.size());
  for (const ElasticTet& tet : tets) {
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      Triangle face{};
      for (std::size_t i = 0, at = 0; i < 4; ++i) {
        if (i != left_out) face[at++] = tet.v[i];
      }
      std::sort(face.begin(), face.end());
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end());
  std::vector<bool> on_surface(vertices);
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end] == faces[i]) ++end;
    if (end == i + 1) {
      for (const Index v : faces[i]) on_surface[v] = true;
    }
    i = end;
  }
  return on_surface;
}

/// a_n by vertex.
std::vector<double> VarianceOf(const std::vector<ElasticTet>& tets, std::size_t vertices) {
  const std::vector<bool> on_surface = OnSurface(tets, vertices);
  std::vector<double> variance(vertices, kWallVariance);
  for (const ElasticTet& tet : tets) {
    const bool inside = std::any_of(tet.v.begin(), tet.v.end(), [&](Index v) { return !on_surface[v]; });
    if (!inside) continue;
    for (const Index v : tet.v) variance[v] = kPatchVariance;
  }
  return variance;
}

/// Contribution of one tetrahedron to the pair of its vertices n and v.
struct Share {
  Vec3d gradient;  ///< V_n g_nv.
  double weight;   ///< w_nv.
};

struct Shares {
  std::vector<Share> all;                                       ///< In the order of the tetrahedra.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted;  ///< (n, v) in one number, and the index in `all`.
};

Shares SharesOf(const std::vector<ElasticTet>& tets, const std::vector<double>& variance) {
  Shares shares;
  constexpr std::size_t kPairs = 16;  // Of the four vertices of a tetrahedron, in order.
  shares.all.reserve(kPairs * tets.size());
  shares.sorted.reserve(kPairs * tets.size());
  for (const ElasticTet& tet : tets) {
    Eigen::Matrix<double, 3, 4> g;
    g.rightCols<3>() = tet.inverse_edges.transpose();
    g.col(0) = -g.rightCols<3>().rowwise().sum();
    double mean = 0;
    for (const Index v : tet.v) mean += variance[v] / 4;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const std::uint64_t n = tet.v[static_cast<std::size_t>(i)], v = tet.v[static_cast<std::size_t>(j)];
        shares.sorted.emplace_back(n << 32 | v, static_cast<std::uint32_t>(shares.all.size()));
        shares.all.push_back({tet.volume / 4 * g.col(j), -mean * tet.scale * tet.volume * g.col(i).dot(g.col(j))});
      }
    }
  }
  // The index is part of the key: sums are taken in the order of the tetrahedra, the same in every run.
  std::sort(shares.sorted.begin(), shares.sorted.end());
  return shares;
}

}  // namespace

void AddOrganPatches(ElasticModel* model) {
  std::vector<double> volume(model->rest_position.size()), scale(volume.size(), 1.0);
  for (const ElasticTet& tet : model->tets) {
    for (const Index n : tet.v) {
      volume[n] += tet.volume / 4;
      scale[n] = tet.scale;
    }
  }
  const std::vector<double> variance = VarianceOf(model->tets, volume.size());
  const Shares shares = SharesOf(model->tets, variance);
  model->patches.clear();
  model->patch_links.clear();
  model->shear_links.clear();
  for (std::size_t i = 0; i < shares.sorted.size();) {
    const std::uint64_t pair = shares.sorted[i].first;
    Share sum{Vec3d::Zero(), 0};
    for (; i < shares.sorted.size() && shares.sorted[i].first == pair; ++i) {
      const Share& share = shares.all[shares.sorted[i].second];
      sum.gradient += share.gradient;
      sum.weight += share.weight;
    }
    const auto n = static_cast<Index>(pair >> 32), v = static_cast<Index>(pair);
    if (model->patches.empty() || model->patches.back().vertex != n) {
      model->patches.push_back(
          {n, scale[n] * volume[n], variance[n], static_cast<Index>(model->patch_links.size()), 0});
    }
    model->patch_links.push_back({v, sum.gradient / volume[n]});
    ++model->patches.back().link_count;
    if (n < v) model->shear_links.push_back({n, v, model->mu_Pa * sum.weight});
  }
}

}  // namespace fulcrum::physics
