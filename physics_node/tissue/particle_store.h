// Storage of the particles. One pool of floats, so that a constraint can join any two particles:
//
//   [ tube: x y z w of each vertex, one more as padding | membrane: plane x | plane y | plane z | plane w ]
//
// Constraints of the tube gather its vertices in any order, so each vertex is one 16-byte load. The membrane is a grid
// that kernels sweep row by row, so its coordinates are planes of lane-blocked rows (GridArrays in batches.h). A
// ParticleRef addresses both. w is the inverse mass in effect: 0 for fixed, grasped and dead particles.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "physics_node/tissue/batches.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

/// Coordinates of a particle are pool[base], pool[base + step], pool[base + 2 * step], its w at 3 * step.
struct ParticleRef {
  std::uint32_t base = 0;
  std::uint32_t step = 1;
};

/// x y z of a particle in any array of the pool's layout.
inline Vec3f FieldAt(const float* field, ParticleRef r) {
  const std::size_t s = r.step;
  return {field[r.base], field[r.base + s], field[r.base + 2 * s]};
}
inline void PutField(float* field, ParticleRef r, const Vec3f& v) {
  const std::size_t s = r.step;
  field[r.base] = v.x();
  field[r.base + s] = v.y();
  field[r.base + 2 * s] = v.z();
}
inline void AddField(float* field, ParticleRef r, const Vec3f& v) {
  const std::size_t s = r.step;
  field[r.base] += v.x();
  field[r.base + s] += v.y();
  field[r.base + 2 * s] += v.z();
}

/// Lane-blocked rows of the membrane.
struct GridLayout {
  std::uint32_t rows = 0, cols = 0;
  std::uint32_t slots = 0;   ///< Columns per lane.
  std::uint32_t stride = 0;  ///< Floats per row.

  GridLayout() = default;
  GridLayout(std::uint32_t row_count, std::uint32_t col_count)
      : rows(row_count), cols(col_count), slots((col_count + kLanes - 1) / kLanes), stride(slots * kLanes) {}
  [[nodiscard]] std::uint32_t Offset(std::uint32_t row, std::uint32_t col) const {
    return row * stride + (col % slots) * kLanes + col / slots;
  }
  [[nodiscard]] std::uint32_t RowAt(std::uint32_t offset) const { return offset / stride; }
  [[nodiscard]] std::uint32_t ColAt(std::uint32_t offset) const {
    return offset % kLanes * slots + offset % stride / kLanes;
  }
  [[nodiscard]] std::uint32_t plane() const { return rows * stride; }
};

/// Bytes of a cache line, which is also the widest vector.
inline constexpr std::size_t kCacheLine = 64;
/// Floats in a cache line.
inline constexpr std::uint32_t kCacheLineFloats = 16;

/// Zeroed floats that begin on a cache line.
class FloatArray {
 public:
  explicit FloatArray(std::size_t count = 0)
      : size_(count),
        data_(static_cast<float*>(
            std::aligned_alloc(kCacheLine, ((count * sizeof(float) + kCacheLine) / kCacheLine) * kCacheLine))) {
    std::fill_n(data_.get(), count, 0.0f);
  }
  [[nodiscard]] float* data() { return data_.get(); }
  [[nodiscard]] const float* data() const { return data_.get(); }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] float& operator[](std::size_t i) { return data_.get()[i]; }
  [[nodiscard]] float operator[](std::size_t i) const { return data_.get()[i]; }

 private:
  struct Free {
    void operator()(float* p) const { std::free(p); }
  };
  std::size_t size_;
  std::unique_ptr<float, Free> data_;
};

class ParticleStore {
 public:
  explicit ParticleStore(const TissueScene& scene)
      : tube_count_(scene.tube_vertex_count),
        particle_count_(static_cast<Index>(scene.rest_position.size())),
        first_node_(scene.membrane.first),
        layout_(scene.membrane.rows, scene.membrane.cols),
        tube_floats_((4 * (tube_count_ + 1) + kCacheLineFloats - 1) / kCacheLineFloats * kCacheLineFloats),
        now_(tube_floats_ + 4 * layout_.plane()),
        previous_(tube_floats_ + 4 * layout_.plane()) {
    for (Index p = 0; p < particle_count_; ++p) {
      const ParticleRef at = Ref(p);
      Set(at, scene.rest_position[p]);
      SetPrevious(at, scene.rest_position[p]);
      SetInverseMass(at, scene.inverse_mass[p]);
    }
    PadGrid();
  }

  [[nodiscard]] Index tube_count() const { return tube_count_; }
  [[nodiscard]] Index particle_count() const { return particle_count_; }
  [[nodiscard]] const GridLayout& layout() const { return layout_; }
  /// Tube vertex of no constraint: fills the unused lanes of a batch.
  [[nodiscard]] Index padding_vertex() const { return tube_count_; }

  [[nodiscard]] ParticleRef Ref(Index particle) const {
    if (particle < tube_count_) {
      return {4 * particle, 1};
    }
    const Index node = particle - first_node_;
    return NodeRef(node / layout_.cols, node % layout_.cols);
  }
  [[nodiscard]] ParticleRef NodeRef(std::uint32_t row, std::uint32_t col) const {
    return {tube_floats_ + layout_.Offset(row, col), layout_.plane()};
  }

  [[nodiscard]] Vec3f At(ParticleRef r) const { return FieldAt(now_.data(), r); }
  [[nodiscard]] Vec3f Previous(ParticleRef r) const { return FieldAt(previous_.data(), r); }
  [[nodiscard]] float InverseMass(ParticleRef r) const { return now_[r.base + 3 * std::size_t{r.step}]; }
  void Set(ParticleRef r, const Vec3f& p) { PutField(now_.data(), r, p); }
  void SetPrevious(ParticleRef r, const Vec3f& p) { PutField(previous_.data(), r, p); }
  void SetInverseMass(ParticleRef r, float w) { now_[r.base + 3 * std::size_t{r.step}] = w; }

  [[nodiscard]] float* pool() { return now_.data(); }
  [[nodiscard]] float* tube() { return now_.data(); }
  /// Floats of the tube with its padding: whole cache lines.
  [[nodiscard]] std::size_t tube_floats() const { return tube_floats_; }
  [[nodiscard]] float* tube_previous() { return previous_.data(); }
  /// Plane 0..2: x, y, z; 3: inverse mass.
  [[nodiscard]] float* plane(int axis) { return now_.data() + tube_floats_ + std::size_t(axis) * layout_.plane(); }
  [[nodiscard]] const float* plane(int axis) const {
    return now_.data() + tube_floats_ + std::size_t(axis) * layout_.plane();
  }
  [[nodiscard]] float* previous_plane(int axis) {
    return previous_.data() + tube_floats_ + std::size_t(axis) * layout_.plane();
  }

  /// Positions of all particles in scene order, x y z interleaved; 3 * particle_count() floats.
  void CopyPositions(std::span<float> xyz) const { Copy(now_.data(), xyz); }
  void CopyPrevious(std::span<float> xyz) const { Copy(previous_.data(), xyz); }
  /// previous <- now.
  void StorePositions() { StorePositions(0, now_.size()); }
  /// The same for `count` floats of the pool.
  void StorePositions(std::size_t first, std::size_t count) {
    std::copy_n(now_.data() + first, count, previous_.data() + first);
  }

  /// Blocks of particles whose largest movement is measured: of the tube 8 vertices; then of each row of the membrane
  /// the columns of each lane.
  static constexpr Index kBlockVertices = 8;
  static constexpr std::uint32_t kBlocksPerRow = 8;
  [[nodiscard]] Index tube_blocks() const { return (tube_count_ + kBlockVertices - 1) / kBlockVertices; }
  [[nodiscard]] Index block_count() const { return tube_blocks() + kBlocksPerRow * layout_.rows; }
  [[nodiscard]] Index BlockOf(Index particle) const {
    if (particle < tube_count_) {
      return particle / kBlockVertices;
    }
    const Index node = particle - first_node_, lane = node % layout_.cols / layout_.slots;
    return tube_blocks() + node / layout_.cols * kBlocksPerRow + lane * kBlocksPerRow / kLanes;
  }
  /// Raises moved[b] to an upper bound of the distance of the block's particles from their previous positions [m], for
  /// the blocks of tube vertices [first, end) or of membrane rows [first, end).
  void MeasureTube(Index first, Index end, float* moved) const;
  void MeasureRows(std::uint32_t first, std::uint32_t end, float* moved) const;
  /// The same for all blocks, starting from 0.
  void MeasureMoves(std::vector<float>* moved) const;
  /// Restores coordinates that are not finite, or not below `limit` in size, from the previous ones; returns their
  /// number.
  std::uint32_t RepairPlaces(float limit) {
    std::uint32_t repaired = 0;
    const std::size_t count = tube_floats_ + 3 * std::size_t{layout_.plane()};  // All but the masses of the membrane.
    for (std::size_t i = 0; i < count; ++i) {
      const bool mass = i < tube_floats_ && i % 4 == 3;
      if (!mass && !(std::abs(now_[i]) < limit)) {
        now_[i] = previous_[i];
        ++repaired;
      }
    }
    return repaired;
  }
  void SetAll(std::span<const float> xyz, std::span<const float> previous_xyz) {
    for (Index p = 0; p < particle_count_; ++p) {
      const ParticleRef at = Ref(p);
      Set(at, Vec3f(xyz[3 * p], xyz[3 * p + 1], xyz[3 * p + 2]));
      SetPrevious(at, Vec3f(previous_xyz[3 * p], previous_xyz[3 * p + 1], previous_xyz[3 * p + 2]));
    }
    PadGrid();
  }
  /// Sets the previous positions to the present ones, which makes all velocities zero.
  void StopAll() {
    for (Index p = 0; p < particle_count_; ++p) {
      const ParticleRef at = Ref(p);
      SetPrevious(at, At(at));
    }
    PadGrid();
  }
  /// The pool in memory order. The padding is constant.
  [[nodiscard]] std::span<const float> raw() const { return {now_.data(), now_.size()}; }
  /// The pool in parts for threads: ranges of the tube, of the planes x, y and z and of the inverse masses of the
  /// membrane. Neighbours in the tissue are mostly in the same part.
  static constexpr int kParts = 8;
  [[nodiscard]] std::array<std::span<const float>, 5> Part(int part) const {
    const auto cut = [part](std::size_t first, std::size_t units, std::size_t unit) {
      const std::size_t begin = units * static_cast<std::size_t>(part) / kParts;
      const std::size_t end = units * (static_cast<std::size_t>(part) + 1) / kParts;
      return std::pair(first + begin * unit, (end - begin) * unit);
    };
    std::array<std::span<const float>, 5> stretches;
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      const auto [first, count] =
          i == 0 ? cut(0, tube_floats_ / kCacheLineFloats, kCacheLineFloats)
                 : cut(tube_floats_ + (i - 1) * std::size_t{layout_.plane()}, layout_.rows, layout_.stride);
      stretches[i] = {now_.data() + first, count};
    }
    return stretches;
  }

 private:
  void Copy(const float* pool, std::span<float> xyz) const {
    float* out = xyz.data();
    for (Index v = 0; v < tube_count_; ++v, out += 3) {
      out[0] = pool[4 * v];
      out[1] = pool[4 * v + 1];
      out[2] = pool[4 * v + 2];
    }
    const std::size_t plane = layout_.plane();
    for (std::uint32_t row = 0; row < layout_.rows; ++row) {
      const float* at = pool + tube_floats_ + std::size_t{row} * layout_.stride;
      std::uint32_t col = 0;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        for (std::uint32_t slot = 0; slot < layout_.slots && col < layout_.cols; ++slot, ++col, out += 3) {
          const float* node = at + slot * kLanes + lane;
          out[0] = node[0];
          out[1] = node[plane];
          out[2] = node[2 * plane];
        }
      }
    }
  }
  /// Columns beyond the last one repeat its position, so that bounds of blocks stay tight.
  void PadGrid() {
    for (std::uint32_t row = 0; row < layout_.rows; ++row) {
      const ParticleRef last = NodeRef(row, layout_.cols - 1);
      for (std::uint32_t col = layout_.cols; col < layout_.stride; ++col) {
        Set(NodeRef(row, col), At(last));
        SetPrevious(NodeRef(row, col), At(last));
      }
    }
  }

  Index tube_count_, particle_count_, first_node_;
  GridLayout layout_;
  std::uint32_t tube_floats_;
  FloatArray now_, previous_;
};

}  // namespace fulcrum::physics
