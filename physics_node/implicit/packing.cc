// How the solver's arrays come out of ElasticModel, and how they follow what cutting and shrinking do.
#include "physics_node/implicit/implicit_solver.h"

namespace fulcrum::physics::implicit {
namespace {

/// A node is frayed when cuts have left it at most half of its six edges: the border of a clean cut keeps four.
constexpr int kFrayed = 3;
/// Of what is left of a frayed node's edges: stiffness across them, in the solve only, over that along them.
constexpr float kFrayedStiffness = 0.05f;

}  // namespace

void ImplicitSolver::PackSheet(const ElasticModel& model) {
  const GridLayout& layout = particles_->layout();
  sheet_mass_ = FloatArray(plane_);
  for (int d = 0; d < 3; ++d) {
    const auto i = static_cast<std::size_t>(d);
    inverse_rest_[i] = FloatArray(plane_);
    axial_[i] = FloatArray(plane_);
    axial_uncut_[i] = FloatArray(plane_);
  }
  missing_edges_.assign(plane_, 0);
  for (std::uint32_t row = 0; row < layout.rows; ++row) {
    for (std::uint32_t col = 0; col < layout.cols; ++col) {
      const std::uint32_t node = row * layout.cols + col, at = layout.Offset(row, col);
      sheet_mass_[at] = static_cast<float>(model.mass[tube_count_ + node]);
      for (std::size_t d = 0; d < 3; ++d) {
        const ElasticSpring& spring = model.springs[3 * node + d];
        axial_uncut_[d][at] = static_cast<float>(spring.axial);
        axial_[d][at] = axial_uncut_[d][at];
        inverse_rest_[d][at] = spring.axial > 0 ? static_cast<float>(1.0 / spring.rest_length) : 1.0f;
      }
    }
  }
}

void ImplicitSolver::PackOrgan(const ElasticModel& model, std::uint32_t tube_count) {
  mu_ = static_cast<float>(model.mu_Pa);
  lambda_ = static_cast<float>(model.lambda_Pa + model.mu_Pa);
  volume_ = FloatArray(tube_count + kPatchGroup);
  organ_mass_ = FloatArray(tube_count + kPatchGroup);
  start_.assign(tube_count + 1, 0);
  patch_start_.assign(tube_count + 1, 0);
  for (const ElasticPatch& patch : model.patches) {
    volume_[patch.vertex] = static_cast<float>(patch.volume);
    start_[patch.vertex + 1] = patch.link_count;
  }
  for (const ElasticPatchLink& link : model.patch_links) {
    ++patch_start_[link.v + 1];
  }
  for (std::uint32_t v = 0; v < tube_count; ++v) {
    organ_mass_[v] = static_cast<float>(model.mass[v]);
    start_[v + 1] += start_[v];
    patch_start_[v + 1] += patch_start_[v];
  }
  const std::size_t links = model.patch_links.size();
  vertex_.resize(links);
  patch_.resize(links);
  gradient_ = FloatArray(4 * links);
  patch_gradient_ = FloatArray(4 * links);
  std::vector<std::uint32_t> next(patch_start_.begin(), patch_start_.end());
  for (const ElasticPatch& patch : model.patches) {
    for (Index i = 0; i < patch.link_count; ++i) {
      const ElasticPatchLink& link = model.patch_links[patch.first_link + i];
      const std::uint32_t to = start_[patch.vertex] + i, back = next[link.v]++;
      vertex_[to] = link.v;
      patch_[back] = patch.vertex;
      for (int axis = 0; axis < 3; ++axis) {
        const auto g = static_cast<float>(link.gradient[axis]);
        gradient_[4 * std::size_t{to} + static_cast<std::size_t>(axis)] = g;
        patch_gradient_[4 * std::size_t{back} + static_cast<std::size_t>(axis)] = g;
      }
    }
  }
  const auto edge = [&](Index from, Index to) -> float& {
    for (std::uint32_t i = patch_start_[from];; ++i) {
      if (patch_[i] == to) {
        return patch_gradient_[4 * std::size_t{i} + 3];
      }
    }
  };
  for (const ElasticShearLink& link : model.shear_links) {
    const auto k = static_cast<float>(link.stiffness);
    edge(link.a, link.b) = k;
    edge(link.b, link.a) = k;
  }
  // The same by patch, for products that gather nothing.
  next.assign(patch_start_.begin(), patch_start_.end());
  for (const ElasticPatch& patch : model.patches) {
    for (Index i = 0; i < patch.link_count; ++i) {
      const std::uint32_t back = next[model.patch_links[patch.first_link + i].v]++;
      gradient_[4 * std::size_t{start_[patch.vertex] + i} + 3] = patch_gradient_[4 * std::size_t{back} + 3];
    }
  }
}

/// Regions, and which of them the organ's patches and the bindings join.
Regions ImplicitSolver::MakeRegions(const ElasticModel& model) const {
  std::vector<std::pair<ParticleRef, ParticleRef>> joined;
  for (const ElasticPatch& patch : model.patches) {
    for (Index i = patch.first_link; i < patch.first_link + patch.link_count; ++i) {
      joined.emplace_back(particles_->Ref(patch.vertex), particles_->Ref(model.patch_links[i].v));
    }
  }
  for (const ElasticBinding& binding : model.bindings) {
    for (const Index v : binding.surface) {
      joined.emplace_back(particles_->Ref(binding.membrane), particles_->Ref(v));
    }
  }
  return Regions(*particles_, joined);
}

void ImplicitSolver::FollowEdge(const TissueModel& tissue, Index row, Index col, std::size_t direction) {
  const GridLayout& layout = particles_->layout();
  const std::uint32_t at = layout.Offset(row, col);
  const float rest = tissue.rest(static_cast<int>(direction))[at], before = axial_[direction][at];
  axial_[direction][at] = rest > 0.0f ? axial_uncut_[direction][at] : 0.0f;
  if (rest > 0.0f) {
    inverse_rest_[direction][at] = 1.0f / (rest * rest_scale_);
  }
  if ((before > 0.0f) != (axial_[direction][at] > 0.0f)) {
    const int missing = before > 0.0f ? 1 : -1;
    missing_edges_[at] += missing;
    missing_edges_[layout.Offset(row + (direction != 0 ? 1 : 0), col + (direction != 1 ? 1 : 0))] += missing;
  }
}

void ImplicitSolver::FindFrayed() {
  const GridLayout& layout = particles_->layout();
  frayed_.clear();
  frayed_edges_.clear();
  const auto add = [&](std::size_t direction, std::uint32_t at, std::uint32_t other) {
    const float along = axial_[direction][at] * inverse_rest_[direction][at];
    if (along > 0.0f) {
      frayed_edges_.push_back({direction, {at, other}, kFrayedStiffness * along});
    }
  };
  for (std::uint32_t at = 0; at < missing_edges_.size(); ++at) {
    if (missing_edges_[at] < kFrayed) {
      continue;
    }
    frayed_.push_back({static_cast<std::uint32_t>(tube_floats_) + at, static_cast<std::uint32_t>(plane_)});
    const Index row = layout.RowAt(at), col = layout.ColAt(at);
    for (std::size_t d = 0; d < 3; ++d) {
      const Index down = d != 0 ? 1 : 0, right = d != 1 ? 1 : 0;
      if (row + down < layout.rows && col + right < layout.cols) {
        add(d, at, layout.Offset(row + down, col + right));
      }
      // Of an edge between two frayed nodes the first one tells.
      if (row >= down && col >= right && missing_edges_[layout.Offset(row - down, col - right)] < kFrayed) {
        add(d, layout.Offset(row - down, col - right), at);
      }
    }
  }
}

void ImplicitSolver::Follow(const TissueModel& tissue) {
  const GridLayout& layout = particles_->layout();
  for (const Index edge : tissue.edited_edges()) {
    const Index row = edge / 3 / layout.cols, col = edge / 3 % layout.cols;
    FollowEdge(tissue, row, col, edge % 3);
    coarse_.MarkEdit(row, col, edge % 3);
    regions_.Wake(regions_.Of(particles_->NodeRef(row, col)));
    regions_.Wake(regions_.Of(particles_->NodeRef(std::min(row + 1, layout.rows - 1), col)));
  }
  FindFrayed();
  coarse_.ScaleBlocks(MakeSheet());
  elements_.Follow(tissue);
  elements_.FollowRegions(regions_);
  around_due_ = true;
}

}  // namespace fulcrum::physics::implicit
