#include "physics_node/collision/surface_bounds.h"

namespace fulcrum::physics {
namespace {

/// Tube triangles per bounding sphere.
constexpr std::size_t kChunkSize = 8;

/// Interleaves ten bits of each coordinate: neighbours in space become neighbours in order.
std::uint32_t Morton(const Vec3f& unit) {
  std::uint32_t code = 0;
  for (int bit = 9; bit >= 0; --bit) {
    for (int axis = 0; axis < 3; ++axis) {
      code = code << 1 | (static_cast<std::uint32_t>(unit[axis] * 1023.0f) >> bit & 1u);
    }
  }
  return code;
}

}  // namespace

SurfaceBounds::SurfaceBounds(const SceneView& scene, const TissueModel* model, ParticleStore* particles,
                             const Kernels& kernels)
    : scene_(scene),
      particles_(particles),
      model_(model),
      kernels_(kernels),
      slot_blocks_((particles->layout().slots + 7) / 8),
      row_blocks_((std::max(particles->layout().rows, 2u) - 1 + 7) / 8) {
  for (std::size_t i = 0; i < 6; ++i) {
    bound_storage_[i].assign(std::size_t{row_blocks_} * slot_blocks_ * kLanes + kLanes, 0.0f);
    // The kernel stores whole vectors: start on a 32-byte boundary.
    float* data = bound_storage_[i].data();
    while (reinterpret_cast<std::uintptr_t>(data) % 32 != 0) {
      ++data;
    }
    (i < 3 ? bounds_.lo[i] : bounds_.hi[i - 3]) = data;
  }
  Vec3f low = Vec3f::Constant(3e38f), high = Vec3f::Constant(-3e38f);
  for (const Vec3f& p : scene.rest_position) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  std::vector<std::pair<std::uint32_t, Index>> order;
  for (Index t = 0; t < scene.tube_surface.size(); ++t) {
    const Triangle& v = scene.tube_surface[t];
    const Vec3f centre = (scene.rest_position[v[0]] + scene.rest_position[v[1]] + scene.rest_position[v[2]]) / 3.0f;
    order.emplace_back(Morton((centre - low).cwiseQuotient(high - low + Vec3f::Constant(1e-6f))), t);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [code, t] : order) {
    tube_order_.push_back(t);
  }
  for (std::size_t first = 0; first < tube_order_.size(); first += kChunkSize) {
    Chunk chunk;
    chunk.first = static_cast<Index>(first);
    chunk.last = static_cast<Index>(std::min(first + kChunkSize, tube_order_.size()));
    chunks_.push_back(chunk);
  }
  Update({});
}

void SurfaceBounds::FitMembrane() {
  const GridLayout& layout = particles_->layout();
  const GridArrays grid{particles_->plane(0),
                        particles_->plane(1),
                        particles_->plane(2),
                        particles_->plane(3),
                        {model_->rest(0), model_->rest(1), model_->rest(2)},
                        static_cast<int>(layout.rows),
                        static_cast<int>(layout.slots)};
  kernels_.block_bounds(grid, bounds_);
}

void SurfaceBounds::FitChunk(Chunk* chunk) {
  Vec3f lo = Vec3f::Constant(3e38f), hi = Vec3f::Constant(-3e38f);
  for (Index i = chunk->first; i < chunk->last; ++i) {
    for (const Index v : scene_.tube_surface[tube_order_[i]]) {
      const Vec3f p = particles_->At({4 * v, 1});
      lo = lo.cwiseMin(p);
      hi = hi.cwiseMax(p);
    }
  }
  chunk->centre = 0.5f * (lo + hi);
  chunk->radius = 0.5f * (hi - lo).norm();
}

void SurfaceBounds::Update(std::span<const Capsule> tools) {
  if (tools.empty() && fitted_) {
    fitted_ = false;  // Nobody looks: everything anew for the next tool.
    return;
  }
  FitMembrane();
  turn_ = (turn_ + 1) % kTurns;
  low_ = Vec3f::Constant(3e38f);
  high_ = Vec3f::Constant(-3e38f);
  const std::size_t blocks = std::size_t{row_blocks_} * slot_blocks_ * kLanes;
  for (int axis = 0; axis < 3; ++axis) {
    low_[axis] = *std::min_element(bounds_.lo[axis], bounds_.lo[axis] + blocks);
    high_[axis] = *std::max_element(bounds_.hi[axis], bounds_.hi[axis] + blocks);
  }
  for (std::size_t i = 0; i < chunks_.size(); ++i) {
    Chunk& chunk = chunks_[i];
    const auto near = [&](const Capsule& tool) {
      return !Beyond(chunk.centre, tool.a, tool.b, kFar + chunk.radius + tool.radius);
    };
    if (!fitted_ || i % kTurns == turn_ || std::any_of(tools.begin(), tools.end(), near)) {
      FitChunk(&chunk);
    }
    low_ = low_.cwiseMin(chunk.centre - Vec3f::Constant(chunk.radius));
    high_ = high_.cwiseMax(chunk.centre + Vec3f::Constant(chunk.radius));
  }
  fitted_ = true;
}

bool SurfaceBounds::MayTouch(const Vec3f& a, const Vec3f& b, float range) const {
  const Vec3f lo = a.cwiseMin(b), hi = a.cwiseMax(b);
  return !(lo.array() > high_.array() + range).any() && !(hi.array() < low_.array() - range).any();
}

}  // namespace fulcrum::physics
