#include "physics_node/collision/surface_bounds.h"

namespace fulcrum::physics {
namespace {

/// Triangles in a leaf, leaves in a cluster: 64 triangles of the organ in a cluster. Assumed.
constexpr std::size_t kLeafSize = 8, kClusterSize = 8;
/// Bits of each coordinate in a Morton code: three of them fit 32 bits.
constexpr int kMortonBits = 10;
/// Added to the size of the tissue's box, which may be flat [m].
constexpr float kLeastExtent = 1e-6f;
/// Movement since the last fit above which bounds are fitted again wherever the tools are; Invalidate() sets more [m].
constexpr float kInvalidAge = 1e3f;

/// Interleaves the bits of the coordinates, each in [0, 1): the order of the codes keeps neighbours in space together
/// (Morton 1966).
std::uint32_t Morton(const Vec3f& unit) {
  constexpr float kLargest = (1 << kMortonBits) - 1;
  std::uint32_t code = 0;
  for (int bit = kMortonBits - 1; bit >= 0; --bit) {
    for (int axis = 0; axis < 3; ++axis) {
      code = code << 1 | (static_cast<std::uint32_t>(unit[axis] * kLargest) >> bit & 1u);
    }
  }
  return code;
}

}  // namespace

SurfaceBounds::SurfaceBounds(const TissueScene& scene, const TissueModel* model, ParticleStore* particles,
                             const collision::Kernels& kernels)
    : scene_(scene),
      particles_(particles),
      model_(model),
      kernels_(kernels),
      slot_blocks_((particles->layout().slots + kBlockCells - 1) / kBlockCells),
      row_blocks_((std::max(particles->layout().rows, 2u) - 1 + kBlockCells - 1) / kBlockCells) {
  for (std::size_t i = 0; i < 6; ++i) {
    bound_storage_[i].assign(std::size_t{row_blocks_} * slot_blocks_ * kLanes + kLanes, 0.0f);
    // The kernel stores whole vectors to aligned addresses.
    float* data = bound_storage_[i].data();
    while (reinterpret_cast<std::uintptr_t>(data) % (kLanes * sizeof(float)) != 0) {
      ++data;
    }
    (i < 3 ? bounds_.lo[i] : bounds_.hi[i - 3]) = data;
  }
  Vec3f low = Vec3f::Constant(kLargestFinite), high = Vec3f::Constant(-kLargestFinite);
  for (const Vec3f& p : scene.rest_position) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  std::vector<std::pair<std::uint32_t, Index>> order;
  for (Index t = 0; t < scene.tube_surface.size(); ++t) {
    const Triangle& v = scene.tube_surface[t];
    const Vec3f centre = (scene.rest_position[v[0]] + scene.rest_position[v[1]] + scene.rest_position[v[2]]) / 3.0f;
    order.emplace_back(Morton((centre - low).cwiseQuotient(high - low + Vec3f::Constant(kLeastExtent))), t);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [code, t] : order) {
    tube_order_.push_back(t);
  }
  for (std::size_t first = 0; first < tube_order_.size(); first += kLeafSize) {
    leaves_.push_back({static_cast<Index>(first), static_cast<Index>(std::min(first + kLeafSize, tube_order_.size()))});
  }
  leaf_start_.push_back(0);
  for (const Sphere& leaf : leaves_) {
    std::vector<Index> vertices;
    for (Index i = leaf.first; i < leaf.last; ++i) {
      const Triangle& v = scene.tube_surface[tube_order_[i]];
      vertices.insert(vertices.end(), v.begin(), v.end());
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    leaf_vertices_.insert(leaf_vertices_.end(), vertices.begin(), vertices.end());
    leaf_start_.push_back(static_cast<Index>(leaf_vertices_.size()));
  }
  for (std::size_t first = 0; first < leaves_.size(); first += kClusterSize) {
    clusters_.push_back(
        {static_cast<Index>(first), static_cast<Index>(std::min(first + kClusterSize, leaves_.size()))});
  }
  age_.assign(clusters_.size(), 0.0f);
  for (Sphere& cluster : clusters_) {
    FitCluster(&cluster);
  }
  strips_.resize(row_blocks_);
  Invalidate();
  Update({});
}

void SurfaceBounds::FitStrip(Strip* strip, std::uint32_t row_block) {
  const GridLayout& layout = particles_->layout();
  // The nodes of kBlockCells rows of cells: one row more.
  const std::uint32_t row = kBlockCells * row_block, rows = std::min(layout.rows - row, kBlockCells + 1);
  const std::size_t at = std::size_t{row} * layout.stride, first = std::size_t{row_block} * slot_blocks_ * kLanes;
  const GridArrays grid{particles_->plane(0) + at,
                        particles_->plane(1) + at,
                        particles_->plane(2) + at,
                        particles_->plane(3) + at,
                        {model_->rest(0) + at, model_->rest(1) + at, model_->rest(2) + at},
                        static_cast<int>(rows),
                        static_cast<int>(layout.slots)};
  BlockBounds blocks = bounds_;
  for (int axis = 0; axis < 3; ++axis) {
    blocks.lo[axis] += first;
    blocks.hi[axis] += first;
  }
  kernels_.block_bounds(grid, blocks);
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t count = slot_blocks_ * kLanes;
    strip->low[axis] = *std::min_element(blocks.lo[axis], blocks.lo[axis] + count);
    strip->high[axis] = *std::max_element(blocks.hi[axis], blocks.hi[axis] + count);
  }
}

void SurfaceBounds::FitLeaf(Index leaf) {
  Vec3f lo = Vec3f::Constant(kLargestFinite), hi = Vec3f::Constant(-kLargestFinite);
  for (Index i = leaf_start_[leaf]; i < leaf_start_[leaf + 1]; ++i) {
    const Vec3f p = particles_->At({4 * leaf_vertices_[i], 1});
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  leaves_[leaf].centre = 0.5f * (lo + hi);
  leaves_[leaf].radius = 0.5f * (hi - lo).norm();
}

void SurfaceBounds::FitCluster(Sphere* cluster) {
  cluster->centre.setZero();
  for (Index leaf = cluster->first; leaf < cluster->last; ++leaf) {
    FitLeaf(leaf);
    cluster->centre += leaves_[leaf].centre;
  }
  cluster->centre /= static_cast<float>(cluster->last - cluster->first);
  cluster->radius = 0;
  for (Index leaf = cluster->first; leaf < cluster->last; ++leaf) {
    cluster->radius = std::max(cluster->radius, (leaves_[leaf].centre - cluster->centre).norm() + leaves_[leaf].radius);
  }
}

void SurfaceBounds::Update(std::span<const Capsule> tools) {
  all_ = {};
  for (std::uint32_t rb = 0; rb < row_blocks_; ++rb) {
    Strip& strip = strips_[rb];
    strip.age += kTissueStep;
    if (strip.age > kInvalidAge || std::any_of(tools.begin(), tools.end(), [&](const Capsule& tool) {
          return strip.MayTouch(tool.a, tool.b, kReach + strip.age + tool.radius);
        })) {
      FitStrip(&strip, rb);
      strip.age = 0;
    }
    all_.low = all_.low.cwiseMin(strip.low);
    all_.high = all_.high.cwiseMax(strip.high);
  }
  for (std::size_t i = 0; i < clusters_.size(); ++i) {
    Sphere& cluster = clusters_[i];
    age_[i] += kTissueStep;
    const float reach = kReach + age_[i] + cluster.radius;
    if (age_[i] > kInvalidAge || std::any_of(tools.begin(), tools.end(), [&](const Capsule& tool) {
          return !Beyond(cluster.centre, tool.a, tool.b, reach + tool.radius);
        })) {
      FitCluster(&cluster);
      age_[i] = 0;
    }
    all_.low = all_.low.cwiseMin(cluster.centre - Vec3f::Constant(cluster.radius));
    all_.high = all_.high.cwiseMax(cluster.centre + Vec3f::Constant(cluster.radius));
  }
}

bool SurfaceBounds::Strip::MayTouch(const Vec3f& a, const Vec3f& b, float range) const {
  const Vec3f lo = a.cwiseMin(b), hi = a.cwiseMax(b);
  return !(lo.array() > high.array() + range).any() && !(hi.array() < low.array() - range).any();
}

}  // namespace fulcrum::physics
