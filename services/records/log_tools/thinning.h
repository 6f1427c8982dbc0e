// Thinning of a mask to lines one pixel wide, and these lines as branches between junctions.
#pragma once

#include <span>
#include <vector>

#include "services/base/core/types.h"
#include "services/records/log_tools/mask.h"

namespace fulcrum::log_tools {

/// Guo and Hall, "Parallel thinning with two-subiteration algorithms" (1989), A1, then sequential removal of further
/// pixels that are not needed for the connection. The passes of Zhang and Suen would erase slanting lines of two
/// pixels' width. Every 8-connected piece keeps at least one pixel.
/// @param distance DistanceToClear(mask).
[[nodiscard]] Mask Thinned(const Mask& mask, std::span<const float> distance);

struct Pixel {
  int x = 0, y = 0;
};

/// A line of the skeleton. `from` and `to` are junctions, or kFree at a free end; both kFree and `closed`: a loop
/// without a junction.
struct Branch {
  static constexpr int kFree = -1;
  std::vector<Pixel> pixels;  ///< Without the pixels of the junctions.
  int from = kFree, to = kFree;
  bool closed = false;
};

/// Pixels where three branches or more meet.
struct Junction {
  Vec2d centre = Vec2d::Zero();  ///< Mean of the pixels' centres; pixel (0, 0) is centred at (0.5, 0.5).
  float half_width = 0;          ///< Largest distance to the clear region [pixels].
};

struct Skeleton {
  std::vector<Branch> branches;
  std::vector<Junction> junctions;
};

[[nodiscard]] Skeleton Trace(const Mask& thin, std::span<const float> distance);

/// Length by which a branch with one free end extends beyond the hole's edge at its junction, less the width of the
/// hole there and `beyond` pixels: what extends less is a bay of the edge [pixels].
[[nodiscard]] double ExcessOf(const Branch& branch, const Skeleton& skeleton, std::span<const float> distance,
                              const Mask& thin, double beyond);

/// Removes branches with one free end and a negative excess, the shortest first, until there are none or only two meet
/// at their junction.
void PruneSpurs(Mask* thin, std::span<const float> distance, double beyond);

/// Length of a branch from junction to junction or end [pixels].
[[nodiscard]] double LengthOf(const Branch& branch, const Skeleton& skeleton);

}  // namespace fulcrum::log_tools
