// A mask thinned to lines one pixel wide, and these lines as branches between junctions.
#pragma once

#include <span>
#include <vector>

#include "services/base/core/types.h"
#include "services/records/log_tools/mask.h"

namespace fulcrum::log_tools {

/// Guo and Hall, "Parallel thinning with two-subiteration algorithms" (1989), A1, then sequential removal of what is
/// still not needed for the connection. Zhang and Suen's passes would erase slanting lines of two pixels' width. Every
/// 8-connected piece keeps at least a pixel.
/// @param distance DistanceToClear(mask).
[[nodiscard]] Mask Thinned(const Mask& mask, std::span<const float> distance);

struct Pixel {
  int x = 0, y = 0;
};

/// A line of the skeleton. `from` and `to` are junctions, or kFree where it ends; both kFree and `closed`: a loop
/// without a junction.
struct Branch {
  static constexpr int kFree = -1;
  std::vector<Pixel> pixels;  ///< Without those of the junctions.
  int from = kFree, to = kFree;
  bool closed = false;
};

/// Pixels where three branches or more meet.
struct Junction {
  Vec2d centre = Vec2d::Zero();  ///< Mean of their centres; pixel (0, 0) is centred at (0.5, 0.5).
  float half_width = 0;          ///< Largest distance to what is clear [pixels].
};

struct Skeleton {
  std::vector<Branch> branches;
  std::vector<Junction> junctions;
};

[[nodiscard]] Skeleton Trace(const Mask& thin, std::span<const float> distance);

/// Removes branches with a free end that reach less than three quarters of the half width at their junction and
/// `beyond` pixels farther than the hole's edge there, until there is none.
void PruneSpurs(Mask* thin, std::span<const float> distance, double beyond);

/// Length of a branch from junction to junction or end [pixels].
[[nodiscard]] double LengthOf(const Branch& branch, const Skeleton& skeleton);

}  // namespace fulcrum::log_tools
