// Positions as they are sent: rounded to 5 um, whatever they are.
#include "services/base/core/tissue_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace fulcrum {
namespace {

/// Positions as a reader gets them.
std::vector<float> Sent(const std::vector<float>& xyz) {
  std::vector<std::byte> blocks(BlocksFor(xyz.size() / 3) * sizeof(TissueBlock));
  EXPECT_TRUE(PackPositions(xyz, blocks.data()));
  std::vector<float> got(xyz.size());
  UnpackPositions(blocks.data(), got);
  return got;
}

std::vector<float> Random(std::size_t vertices, double extent_m, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(static_cast<float>(-extent_m / 2), static_cast<float>(extent_m / 2));
  std::vector<float> xyz(3 * vertices);
  for (float& x : xyz) x = place(random);
  return xyz;
}

TEST(TissueBlocks, APositionIsOffByAtMostHalfAStep) {
  for (const std::size_t vertices : {0, 1, 63, 64, 65, 1000}) {
    const std::vector<float> xyz = Random(vertices, 0.32, 1), got = Sent(xyz);
    for (std::size_t i = 0; i < xyz.size(); ++i) ASSERT_NEAR(got[i], xyz[i], 0.5 * kTissueStep_m + 3e-8) << i;
    EXPECT_EQ(Sent(got), got) << "what was sent once stays the same";
    std::vector<float> rounded = xyz;
    EXPECT_TRUE(RoundPositions(rounded));
    EXPECT_EQ(rounded, got);
  }
}

TEST(TissueBlocks, AWideBlockIsCoarserAndItsNeighboursAreNot) {
  for (const double extent_m : {0.5, 3.0, 19.0, 1900.0}) {
    std::vector<float> xyz = Random(192, 0.1, 2);
    const std::vector<float> wide = Random(64, extent_m, 3);
    std::copy(wide.begin(), wide.end(), xyz.begin() + 192);
    const std::vector<float> got = Sent(xyz);
    // A coordinate is rounded to a step first, then to the block's coarser step.
    const double step = kTissueStep_m * std::exp2(std::ceil(std::log2(extent_m / (65535 * kTissueStep_m))));
    for (std::size_t i = 0; i < xyz.size(); ++i) {
      const bool is_wide = i >= 192 && i < 384;
      ASSERT_NEAR(got[i], xyz[i], 0.5 * kTissueStep_m + (is_wide ? 0.5 * step : 0) + 1e-7 * extent_m) << i;
    }
  }
}

TEST(TissueBlocks, WhatIsNotFiniteOrFarIsRefused) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  for (const float bad : {kNan, -kNan, kInf, -kInf, 1001.0F, -1e30F}) {
    std::vector<float> xyz = Random(100, 0.1, 4);
    std::vector<std::byte> blocks(BlocksFor(100) * sizeof(TissueBlock));
    xyz[250] = bad;
    EXPECT_FALSE(PackPositions(xyz, blocks.data())) << bad;
    EXPECT_FALSE(RoundPositions(xyz)) << bad;
  }
}

TEST(TissueBlocks, PackingOfUnpackedStepsIsTheSameBlock) {
  std::mt19937 random(5);
  for (int i = 0; i < 2000; ++i) {
    const std::int32_t extent = 1 << (1 + i % 29);
    std::uniform_int_distribution<std::int32_t> place(-extent / 2, extent / 2 - 1);
    BlockSteps steps, again;
    for (std::int32_t& x : steps) x = place(random);
    const TissueBlock block = Pack(steps);
    EXPECT_TRUE(IsCanonical(block)) << i;
    Unpack(block, &again);
    EXPECT_EQ(Pack(again), block) << i;
    TissueBlock other = block;
    ++other.shift;
    const bool is_needed = *std::ranges::max_element(block.offset) > 32767;
    EXPECT_EQ(IsCanonical(other), is_needed && other.shift <= kMostBlockShift) << i;
  }
}

/// Any bytes can arrive.
TEST(TissueBlocks, AnyBlockUnpacks) {
  std::mt19937 random(6);
  for (int i = 0; i < 2000; ++i) {
    TissueBlock block;
    for (std::int32_t& x : block.origin) x = static_cast<std::int32_t>(random());
    block.shift = i % 2 == 0 ? static_cast<std::uint32_t>(random()) : 0;
    for (std::uint16_t& x : block.offset) x = static_cast<std::uint16_t>(random());
    if (i % 4 == 1) block.offset[0] = block.offset[1] = block.offset[2] = 0;
    BlockSteps steps;
    Unpack(block, &steps);
    const TissueBlock again = Pack(steps);
    EXPECT_TRUE(!IsCanonical(block) || again == block) << i;
  }
}

}  // namespace
}  // namespace fulcrum
