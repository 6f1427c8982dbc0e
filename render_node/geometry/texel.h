// Place of a texel in an image stored row by row.
#pragma once

#include <cstddef>

namespace fulcrum::render {

/// @pre x, y and width are not negative.
inline std::size_t TexelIndex(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

}  // namespace fulcrum::render
