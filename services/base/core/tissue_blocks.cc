#include "services/base/core/tissue_blocks.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace fulcrum {
namespace {

constexpr double kStepsPerMetre = 1 / kTissueStep_m;
constexpr float kFarthest_m = 1000;
constexpr std::uint32_t kSign = 0x80000000U;
constexpr std::uint32_t kMostOffset = std::numeric_limits<std::uint16_t>::max();

/// The nearest whole number: the low bits of a sum so large that nothing behind the point remains.
std::int32_t Whole(double steps) {
  constexpr double kLarge = 0x1.8p52;
  return static_cast<std::int32_t>(std::bit_cast<std::uint64_t>(steps + kLarge));
}

/// Compared as bits, which are larger for a NaN than for any number.
bool AllNear(std::span<const float> xyz) {
  std::uint32_t largest = 0;
  for (const float x : xyz) largest = std::max(largest, std::bit_cast<std::uint32_t>(x) & ~kSign);
  return largest <= std::bit_cast<std::uint32_t>(kFarthest_m);
}

/// Rounds the vertices of a block, at least one.
void Round(std::span<const float> xyz, BlockSteps* steps) {
  for (std::size_t i = 0; i < xyz.size(); ++i) {
    (*steps)[i] = Whole(kStepsPerMetre * static_cast<double>(xyz[i]));
  }
  for (std::size_t i = xyz.size(); i < steps->size(); ++i) (*steps)[i] = (*steps)[i - 3];
}

std::span<const float> BlockOf(std::span<const float> xyz, std::size_t block) {
  const std::size_t begin = block * 3 * kBlockVertices;
  return xyz.subspan(begin, std::min(3 * kBlockVertices, xyz.size() - begin));
}

}  // namespace

TissueBlock Pack(const BlockSteps& steps) {
  TissueBlock block;
  std::array<std::int32_t, 3> low{steps[0], steps[1], steps[2]}, high = low;
  for (std::size_t i = 3; i < steps.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], steps[i + k]);
      high[k] = std::max(high[k], steps[i + k]);
    }
  }
  std::uint32_t extent = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    extent = std::max(extent, static_cast<std::uint32_t>(high[k]) - static_cast<std::uint32_t>(low[k]));
  }
  block.origin = low;
  const auto rounded = [](std::uint32_t offset, std::uint32_t shift) {
    return shift == 0 ? offset : (offset + (1U << (shift - 1))) >> shift;
  };
  while (rounded(extent, block.shift) > kMostOffset) ++block.shift;
  for (std::size_t i = 0; i < steps.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto offset = static_cast<std::uint32_t>(steps[i + k]) - static_cast<std::uint32_t>(low[k]);
      block.offset[i + k] = static_cast<std::uint16_t>(rounded(offset, block.shift));
    }
  }
  return block;
}

void Unpack(const TissueBlock& block, BlockSteps* steps) {
  const std::uint32_t shift = block.shift & kMostBlockShift;
  for (std::size_t i = 0; i < steps->size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      (*steps)[i + k] = static_cast<std::int32_t>(static_cast<std::uint32_t>(block.origin[k]) +
                                                  (std::uint32_t{block.offset[i + k]} << shift));
    }
  }
}

bool IsCanonical(const TissueBlock& block) {
  const bool near = std::ranges::all_of(block.origin, [](std::int32_t origin) {
    return origin >= -kMostSteps && origin <= kMostSteps - static_cast<std::int32_t>(kMostOffset);
  });
  if (!near || block.shift > kMostBlockShift) return false;
  if (block.shift != 0) {
    BlockSteps steps;
    Unpack(block, &steps);
    return std::ranges::all_of(steps, [](std::int32_t x) { return x >= -kMostSteps && x <= kMostSteps; }) &&
           Pack(steps) == block;
  }
  std::array<std::uint16_t, 3> low{block.offset[0], block.offset[1], block.offset[2]};
  for (std::size_t i = 3; i < block.offset.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], block.offset[i + k]);
  }
  return (low[0] | low[1] | low[2]) == 0;
}

bool PackPositions(std::span<const float> xyz, std::byte* blocks) {
  if (!AllNear(xyz)) return false;
  BlockSteps steps;
  for (std::size_t b = 0; b < BlocksFor(xyz.size() / 3); ++b) {
    Round(BlockOf(xyz, b), &steps);
    const TissueBlock block = Pack(steps);
    std::memcpy(blocks + b * sizeof block, &block, sizeof block);
  }
  return true;
}

void UnpackPositions(const std::byte* blocks, std::span<float> xyz) {
  BlockSteps steps;
  TissueBlock block;
  for (std::size_t begin = 0; begin < xyz.size(); begin += steps.size(), blocks += sizeof block) {
    std::memcpy(&block, blocks, sizeof block);
    Unpack(block, &steps);
    const std::size_t count = std::min(steps.size(), xyz.size() - begin);
    for (std::size_t i = 0; i < count; ++i) xyz[begin + i] = PositionOf(steps[i]);
  }
}

bool RoundPositions(std::span<float> xyz) {
  if (!AllNear(xyz)) return false;
  BlockSteps steps;
  for (std::size_t b = 0; b < BlocksFor(xyz.size() / 3); ++b) {
    const std::span<const float> positions = BlockOf(xyz, b);
    Round(positions, &steps);
    Unpack(Pack(steps), &steps);
    for (std::size_t i = 0; i < positions.size(); ++i) xyz[b * steps.size() + i] = PositionOf(steps[i]);
  }
  return true;
}

}  // namespace fulcrum
