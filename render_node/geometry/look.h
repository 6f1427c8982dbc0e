// What may differ between pictures of the same scene: patterns of the tissue, its tint, colour and strength of the
// light.
#pragma once

#include <cstdint>

#include "services/base/core/types.h"

namespace fulcrum::render {

struct Look {
  std::uint32_t patterns = 0;    ///< Seed of noise, lobules, vessels and loops of bowel; 0: those of a session.
  Vec3f light = Vec3f::Ones();   ///< Factor on the light that the camera gets: red, green, blue.
  Vec3f tissue = Vec3f::Ones();  ///< Factor on the light that tissue returns.
};

}  // namespace fulcrum::render
