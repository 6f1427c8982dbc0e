#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics {

void ParticleStore::MeasureTube(Index first, Index end, float* moved) const {
  for (Index block = first / kBlockVertices, last = 0; first < end; ++block, first = last) {
    // The largest change per axis: its norm is an upper bound of the distances. Lane 3 holds w, which is constant here.
    float largest[4] = {0, 0, 0, 0};
    last = std::min((block + 1) * kBlockVertices, end);
    for (std::size_t i = 4 * std::size_t{first}; i < 4 * std::size_t{last}; i += 4) {
      for (std::size_t axis = 0; axis < 4; ++axis) {
        const float d = std::abs(now_[i + axis] - previous_[i + axis]);
        largest[axis] = d > largest[axis] ? d : largest[axis];
      }
    }
    moved[block] = std::max(moved[block], Vec3f(largest[0], largest[1], largest[2]).norm());
  }
}

void ParticleStore::MeasureRows(std::uint32_t first, std::uint32_t end, float* moved) const {
  const std::size_t plane = layout_.plane();
  const float *now = now_.data() + tube_floats_, *previous = previous_.data() + tube_floats_;
  for (std::uint32_t row = first; row < end; ++row) {
    float largest_sq[kLanes] = {0, 0, 0, 0, 0, 0, 0, 0};
    for (std::size_t i = std::size_t{row} * layout_.stride; i < std::size_t{row + 1} * layout_.stride; i += kLanes) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const std::size_t x = i + lane, y = x + plane, z = y + plane;
        const float dx = now[x] - previous[x], dy = now[y] - previous[y], dz = now[z] - previous[z];
        const float d = dx * dx + dy * dy + dz * dz;
        largest_sq[lane] = d > largest_sq[lane] ? d : largest_sq[lane];
      }
    }
    constexpr std::uint32_t kPart = kLanes / kBlocksPerRow;
    for (std::uint32_t part = 0; part < kBlocksPerRow; ++part) {
      const float part_sq = *std::max_element(largest_sq + part * kPart, largest_sq + (part + 1) * kPart);
      float& block = moved[tube_blocks() + row * kBlocksPerRow + part];
      block = std::max(block, std::sqrt(part_sq));
    }
  }
}

void ParticleStore::MeasureMoves(std::vector<float>* moved) const {
  moved->assign(block_count(), 0.0f);
  MeasureTube(0, tube_count_, moved->data());
  MeasureRows(0, layout_.rows, moved->data());
}

}  // namespace fulcrum::physics
