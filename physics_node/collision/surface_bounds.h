// Broad phase over the tissue's surface: boxes around blocks of the membrane, spheres around clusters of the organ's
// surface. Local to the tools: what is near one is looked at in each update, the rest in turns.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "physics_node/collision/closest.h"
#include "physics_node/collision/tool_shape.h"
#include "physics_node/pbd/kernels.h"
#include "physics_node/pbd/particle_store.h"
#include "physics_node/pbd/tissue_model.h"

namespace fulcrum::physics {

class SurfaceBounds {
 public:
  SurfaceBounds(const SceneView& scene, const TissueModel* model, ParticleStore* particles, const Kernels& kernels);

  /// Fits the bounds to the tissue around `tools`. What is further than kFar from all of them was fitted at most
  /// kTurns updates ago: tissue slower than 1 m/s cannot have come near unseen.
  void Update(std::span<const Capsule> tools);
  /// False: no tissue within `range` of the segment's box.
  [[nodiscard]] bool MayTouch(const Vec3f& a, const Vec3f& b, float range) const;

  /// visit(row, column, corners, squared distance of the centre): cells of the membrane within `range` of segment ab,
  /// perhaps some more. Corners (r, c), (r, c+1), (r+1, c), (r+1, c+1). The visitor may lower `range` as it goes.
  template <class Visit>
  void ForEachCellNear(const Vec3f& a, const Vec3f& b, const float& range, const Visit& visit) const;
  /// visit(index in SceneView.tube_surface): the same of the organ.
  template <class Visit>
  void ForEachTubeTriangleNear(const Vec3f& a, const Vec3f& b, float range, const Visit& visit) const;

 private:
  /// Updates until everything has been fitted again, and the distance that tissue at 1 m/s covers in that time at
  /// 100 Hz [m].
  static constexpr std::uint32_t kTurns = 4;
  static constexpr float kFar = 0.045f;

  struct Chunk {
    Index first = 0, last = 0;  ///< Of tube_order_.
    Vec3f centre = Vec3f::Zero();
    float radius = 0;
  };
  static bool Beyond(const Vec3f& p, const Vec3f& a, const Vec3f& b, float range) {
    return DistanceSqToSegment(p, a, b) > range * range;
  }
  void FitMembrane();
  void FitChunk(Chunk* chunk);

  SceneView scene_;
  ParticleStore* particles_;
  const TissueModel* model_;
  const Kernels& kernels_;
  std::uint32_t slot_blocks_, row_blocks_;
  std::array<std::vector<float>, 6> bound_storage_;
  BlockBounds bounds_{};
  std::vector<Index> tube_order_;
  std::vector<Chunk> chunks_;
  std::uint32_t turn_ = 0;
  bool fitted_ = false;
  Vec3f low_ = Vec3f::Zero(), high_ = Vec3f::Zero();  ///< Of everything.
};

template <class Visit>
void SurfaceBounds::ForEachCellNear(const Vec3f& a, const Vec3f& b, const float& range, const Visit& visit) const {
  const GridLayout& layout = particles_->layout();
  std::size_t index = 0;
  for (std::uint32_t rb = 0; rb < row_blocks_; ++rb) {
    for (std::uint32_t sb = 0; sb < slot_blocks_; ++sb) {
      for (std::uint32_t lane = 0; lane < kLanes; ++lane, ++index) {
        const Vec3f lo(bounds_.lo[0][index], bounds_.lo[1][index], bounds_.lo[2][index]);
        const Vec3f hi(bounds_.hi[0][index], bounds_.hi[1][index], bounds_.hi[2][index]);
        if ((lo.array() > a.cwiseMax(b).array() + range).any() || (hi.array() < a.cwiseMin(b).array() - range).any() ||
            Beyond(0.5f * (lo + hi), a, b, range + 0.5f * (hi - lo).norm())) {
          continue;
        }
        for (std::uint32_t row = 8 * rb; row < std::min(8 * rb + 8, layout.rows - 1); ++row) {
          for (std::uint32_t slot = 8 * sb; slot < std::min(8 * sb + 8, layout.slots); ++slot) {
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
  for (const Chunk& chunk : chunks_) {
    if (!Beyond(chunk.centre, a, b, range + chunk.radius)) {
      for (Index i = chunk.first; i < chunk.last; ++i) {
        visit(tube_order_[i]);
      }
    }
  }
}

}  // namespace fulcrum::physics
