#pragma once

#include <span>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::render {

/// x, y, z of each point in sequence, as in a Tissue message.
inline std::vector<float> Interleaved(std::span<const Vec3f> positions) {
  std::vector<float> xyz;
  for (const Vec3f& p : positions) xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
  return xyz;
}

}  // namespace fulcrum::render
