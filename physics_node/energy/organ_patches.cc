#include <map>

#include "physics_node/energy/elastic_model.h"

namespace fulcrum::physics {

void AddOrganPatches(ElasticModel* model) {
  // Ordered maps: links come out sorted, and sums are in the order of the tets, the same in every run.
  std::map<Index, double> volume;
  std::map<std::pair<Index, Index>, Vec3d> gradient;  // (patch, vertex): V_n g_nj.
  std::map<std::pair<Index, Index>, double> weight;   // (a, b), a < b: w_ab.
  for (const ElasticTet& tet : model->tets) {
    Eigen::Matrix<double, 3, 4> g;
    g.rightCols<3>() = tet.inverse_edges.transpose();
    g.col(0) = -g.rightCols<3>().rowwise().sum();
    for (int i = 0; i < 4; ++i) {
      const Index n = tet.v[static_cast<std::size_t>(i)];
      volume[n] += tet.volume / 4;
      for (int j = 0; j < 4; ++j) {
        const Index v = tet.v[static_cast<std::size_t>(j)];
        gradient.try_emplace({n, v}, Vec3d::Zero()).first->second += tet.volume / 4 * g.col(j);
        if (n < v) {
          weight[{n, v}] -= tet.volume * g.col(i).dot(g.col(j));
        }
      }
    }
  }
  model->patches.clear();
  model->patch_links.clear();
  model->shear_links.clear();
  for (const auto& [pair, sum] : gradient) {
    const auto& [n, v] = pair;
    if (model->patches.empty() || model->patches.back().vertex != n) {
      model->patches.push_back({n, volume.at(n), static_cast<Index>(model->patch_links.size()), 0});
    }
    model->patch_links.push_back({v, sum / model->patches.back().volume});
    ++model->patches.back().link_count;
  }
  for (const auto& [pair, w] : weight) {
    model->shear_links.push_back({pair.first, pair.second, kPatchVariance * model->mu_Pa * w});
  }
}

}  // namespace fulcrum::physics
