// Positions of a TissueFrame as they are sent and recorded (idl/tissue.idl): rounded to whole steps, in blocks of
// neighbouring vertices with 16 bits a coordinate. 6.25 bytes a vertex instead of 12.
//
// Packing is canonical: the blocks that are made of unpacked steps are those that were unpacked.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace fulcrum {

/// Resolution of a position [m]. A coordinate is off by at most half of it in a block of at most 0.327 m.
inline constexpr double kTissueStep_m = 5e-6;
inline constexpr std::size_t kBlockVertices = 64;

/// Coordinates of a block [steps], x y z interleaved.
using BlockSteps = std::array<std::int32_t, 3 * kBlockVertices>;

/// Coordinate k of vertex i is kTissueStep_m * (origin[k] + (offset[3 * i + k] << shift)). As in memory, so on the
/// wire.
struct TissueBlock {
  std::array<std::int32_t, 3> origin{};  ///< Smallest coordinates in the block [steps].
  std::uint32_t shift = 0;               ///< The smallest with which all offsets fit.
  std::array<std::uint16_t, 3 * kBlockVertices> offset{};

  [[nodiscard]] bool operator==(const TissueBlock&) const = default;
};
static_assert(sizeof(TissueBlock) == 400 && alignof(TissueBlock) == 4);

inline constexpr std::uint32_t kMostBlockShift = 15;

[[nodiscard]] constexpr std::size_t BlocksFor(std::size_t vertices) {
  return (vertices + kBlockVertices - 1) / kBlockVertices;
}

[[nodiscard]] constexpr float PositionOf(std::int32_t steps) {
  return static_cast<float>(kTissueStep_m * static_cast<double>(steps));
}

/// Largest coordinate of a block [steps].
inline constexpr std::int32_t kMostSteps = 1 << 30;

/// @param steps of at most kMostSteps in magnitude.
[[nodiscard]] TissueBlock Pack(const BlockSteps& steps);
/// Of any bytes: the result is modulo 2^32, and only the low four bits of the shift count.
void Unpack(const TissueBlock& block, BlockSteps* steps);
/// Whether Pack makes this block of steps of at most kMostSteps.
[[nodiscard]] bool IsCanonical(const TissueBlock& block);

/// Rounds and packs positions [m], x y z interleaved. Vertices after the last one repeat it. False if a coordinate is
/// not finite or beyond 1 km.
/// @param blocks BlocksFor(xyz.size() / 3) blocks, at any address.
[[nodiscard]] bool PackPositions(std::span<const float> xyz, std::byte* blocks);
/// @param xyz 3 * vertices of them: all of their blocks are read.
void UnpackPositions(const std::byte* blocks, std::span<float> xyz);

/// What a reader gets of these positions. False as for PackPositions.
[[nodiscard]] bool RoundPositions(std::span<float> xyz);

}  // namespace fulcrum
