// Helpers of the codec tests: moving tissue, and a wire that keeps, loses or reorders chunks.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "services/transport/link/codec/patch_codec.h"
#include "services/transport/link/codec/tissue_codec.h"

namespace fulcrum::link::test {

using Chunk = std::vector<std::uint8_t>;

/// A sheet of `rows` x `cols` vertices, 2.5 mm apart, pressed in by `depth_m` about its middle.
inline TissueFrame Sheet(int rows, int cols, double depth_m, std::uint64_t sequence) {
  TissueFrame frame;
  frame.header.stamp = {sequence, 77, static_cast<std::int64_t>(1000 * sequence)};
  frame.header.scene_hash = 5;
  frame.header.session_time_s = 0.01 * static_cast<double>(sequence);
  frame.header.vertex_count = static_cast<std::uint32_t>(rows * cols);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < cols; ++c) {
      const double x = 0.0025 * (c - cols / 2), y = 0.0025 * (r - rows / 2);
      const double d2 = (x * x + y * y) / (0.02 * 0.02);
      // Far from the middle there is no motion.
      const double z = d2 < 4 ? -depth_m * (1 - d2 / 4) * (1 - d2 / 4) : 0.0;
      for (const double value : {x, y, 0.1 + z}) frame.xyz.push_back(static_cast<float>(value));
    }
  }
  return frame;
}

template <class Sender, class Message>
std::vector<Chunk> Encode(Sender* sender, const Message& message) {
  std::vector<Chunk> chunks;
  sender->Encode(message,
                 [&](std::span<const std::uint8_t> chunk) { chunks.emplace_back(chunk.begin(), chunk.end()); });
  return chunks;
}

inline std::size_t Bytes(const std::vector<Chunk>& chunks) {
  std::size_t bytes = 0;
  for (const Chunk& chunk : chunks) bytes += chunk.size();
  return bytes;
}

/// Largest distance of a vertex from its true position [m].
inline double ErrorOf(const TissueFrame& got, const TissueFrame& wanted) {
  double worst = got.xyz.size() == wanted.xyz.size() ? 0 : 1;
  for (std::size_t i = 0; i + 2 < wanted.xyz.size() && worst < 1; i += 3) {
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double d = static_cast<double>(got.xyz[i + k]) - static_cast<double>(wanted.xyz[i + k]);
      squared += d * d;
    }
    worst = std::max(worst, std::sqrt(squared));
  }
  return worst;
}

}  // namespace fulcrum::link::test
