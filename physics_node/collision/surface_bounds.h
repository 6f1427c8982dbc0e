// Broad phase over the tissue's surface: boxes around blocks of the membrane (one vector kernel per strip of
// kBlockCells rows of cells), two levels of spheres around parts of the organ's surface. Both are fitted only near the
// tools: strips and spheres are enlarged by the possible movement of tissue since their last fit, and fitted again when
// they then reach a tool.
//
//   strip      candidate if  lo - R <= hi_s  and  hi + R >= lo_s  per axis      lo_s, hi_s  box of segment ab
//   sphere     candidate if  distance(centre, ab) <= R + radius
//   R          range + possible movement since the last fit (Update), range (queries) [m]
//   leaf       centre (lo + hi) / 2, radius |hi - lo| / 2 of the box of its vertices
//   cluster    centre: mean of its leaves' centres;  radius: max over the leaves of |c_leaf - centre| + r_leaf
//
// Layout: blocks of the membrane as in BlockBounds, one per lane; leaves are runs of kLeafSize triangles in Morton
// order, clusters runs of kClusterSize leaves.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "physics_node/collision/closest.h"
#include "physics_node/collision/kernels.h"
#include "physics_node/collision/tool_shape.h"
#include "physics_node/simd/limits.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics {

class SurfaceBounds {
 public:
  SurfaceBounds(const TissueScene& scene, const TissueModel* model, ParticleStore* particles,
                const collision::Kernels& kernels);

  /// Fits the bounds to the tissue within kReach of `tools`, once a step. Tissue that moves more than kTissueStep in a
  /// step can be missed.
  void Update(std::span<const Capsule> tools);
  /// For steps without Update: the next Update fits all bounds.
  void Invalidate() {
    std::fill(age_.begin(), age_.end(), kLargestFinite);
    std::for_each(strips_.begin(), strips_.end(), [](Strip& strip) { strip.age = kLargestFinite; });
  }
  /// False: no tissue within `range` of the segment's box.
  [[nodiscard]] bool MayTouch(const Vec3f& a, const Vec3f& b, float range) const { return all_.MayTouch(a, b, range); }

  /// visit(row, column, corners, squared distance of the centre): all cells of the membrane within `range` of segment
  /// ab and some beyond. Corners (r, c), (r, c+1), (r+1, c), (r+1, c+1). The visitor may reduce `range`.
  template <class Visit>
  void ForEachCellNear(const Vec3f& a, const Vec3f& b, const float& range, const Visit& visit) const;
  /// visit(index in TissueScene.tube_surface): the same for the organ.
  template <class Visit>
  void ForEachTubeTriangleNear(const Vec3f& a, const Vec3f& b, float range, const Visit& visit) const;

 private:
  /// Bounds this near to a tool are fitted [m]: probes search 10 mm around a tool.
  static constexpr float kReach = 0.015f;
  /// Assumed largest movement of tissue in a step [m]: 1 m/s at 100 Hz.
  static constexpr float kTissueStep = 0.010f;

  struct Sphere {
    Index first = 0, last = 0;  ///< Leaves: of tube_order_; clusters: of leaves_.
    Vec3f centre = Vec3f::Zero();
    float radius = 0;
  };
  /// Bounds of kBlockCells rows of cells.
  struct Strip {
    Vec3f low = Vec3f::Constant(kLargestFinite), high = Vec3f::Constant(-kLargestFinite);
    float age = 0;  ///< Possible movement of tissue since the last fit [m].
    [[nodiscard]] bool MayTouch(const Vec3f& a, const Vec3f& b, float range) const;
  };
  static bool Beyond(const Vec3f& p, const Vec3f& a, const Vec3f& b, float range) {
    return DistanceSqToSegment(p, a, b) > range * range;
  }
  void FitStrip(Strip* strip, std::uint32_t row_block);
  void FitLeaf(Index leaf);
  void FitCluster(Sphere* cluster);

  TissueScene scene_;
  ParticleStore* particles_;
  const TissueModel* model_;
  const collision::Kernels& kernels_;
  std::uint32_t slot_blocks_, row_blocks_;
  std::array<std::vector<float>, 6> bound_storage_;
  BlockBounds bounds_{};
  std::vector<Index> tube_order_;
  std::vector<Index> leaf_start_, leaf_vertices_;  ///< Each vertex of a leaf once.
  std::vector<Sphere> leaves_, clusters_;
  std::vector<float> age_;  ///< By cluster: possible movement of tissue since the last fit [m].
  std::vector<Strip> strips_;
  Strip all_;  ///< Bounds of everything.
};

template <class Visit>
void SurfaceBounds::ForEachCellNear(const Vec3f& a, const Vec3f& b, const float& range, const Visit& visit) const {
  const GridLayout& layout = particles_->layout();
  const Vec3f low = a.cwiseMin(b), high = a.cwiseMax(b);
  const auto apart = [&](std::size_t i) {
    for (int axis = 0; axis < 3; ++axis) {
      if (bounds_.lo[axis][i] > high[axis] + range || bounds_.hi[axis][i] < low[axis] - range) {
        return true;
      }
    }
    return false;
  };
  std::size_t index = 0;
  for (std::uint32_t rb = 0; rb < row_blocks_; ++rb) {
    if (!strips_[rb].MayTouch(a, b, range)) {
      index += std::size_t{slot_blocks_} * kLanes;
      continue;
    }
    for (std::uint32_t sb = 0; sb < slot_blocks_; ++sb) {
      for (std::uint32_t lane = 0; lane < kLanes; ++lane, ++index) {
        if (apart(index)) {
          continue;
        }
        const Vec3f lo(bounds_.lo[0][index], bounds_.lo[1][index], bounds_.lo[2][index]);
        const Vec3f hi(bounds_.hi[0][index], bounds_.hi[1][index], bounds_.hi[2][index]);
        if (Beyond(0.5f * (lo + hi), a, b, range + 0.5f * (hi - lo).norm())) {
          continue;
        }
        const std::uint32_t row0 = kBlockCells * rb, row1 = std::min(row0 + kBlockCells, layout.rows - 1);
        const std::uint32_t slot0 = kBlockCells * sb, slot1 = std::min(slot0 + kBlockCells, layout.slots);
        for (std::uint32_t row = row0; row < row1; ++row) {
          for (std::uint32_t slot = slot0; slot < slot1; ++slot) {
            const std::uint32_t col = lane * layout.slots + slot;
            if (col + 1 >= layout.cols) {
              break;
            }
            const ParticleRef at00 = particles_->NodeRef(row, col), at01 = particles_->NodeRef(row, col + 1);
            const std::array<ParticleRef, 4> corners{
                at00, at01, {at00.base + layout.stride, at00.step}, {at01.base + layout.stride, at01.step}};
            const Vec3f x00 = particles_->At(corners[0]), x01 = particles_->At(corners[1]);
            const Vec3f x10 = particles_->At(corners[2]), x11 = particles_->At(corners[3]);
            const Vec3f centre = 0.25f * (x00 + x01 + x10 + x11);
            const float radius =
                std::sqrt(std::max(std::max((x00 - centre).squaredNorm(), (x11 - centre).squaredNorm()),
                                   std::max((x01 - centre).squaredNorm(), (x10 - centre).squaredNorm())));
            const float distance_sq = DistanceSqToSegment(centre, a, b);
            if (distance_sq <= (range + radius) * (range + radius)) {
              visit(row, col, corners, distance_sq);
            }
          }
        }
      }
    }
  }
}

template <class Visit>
void SurfaceBounds::ForEachTubeTriangleNear(const Vec3f& a, const Vec3f& b, float range, const Visit& visit) const {
  for (const Sphere& cluster : clusters_) {
    if (Beyond(cluster.centre, a, b, range + cluster.radius)) {
      continue;
    }
    for (Index leaf = cluster.first; leaf < cluster.last; ++leaf) {
      if (!Beyond(leaves_[leaf].centre, a, b, range + leaves_[leaf].radius)) {
        for (Index i = leaves_[leaf].first; i < leaves_[leaf].last; ++i) {
          visit(tube_order_[i]);
        }
      }
    }
  }
}

}  // namespace fulcrum::physics
