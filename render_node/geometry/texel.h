// Place of a texel in an image stored row by row.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace fulcrum::render {

/// @pre x, y and width are not negative.
inline std::size_t TexelIndex(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

/// Temperature as in TemperaturePatch: half kelvins above 20 C; what is colder is shown as 20 C.
inline std::uint8_t TemperatureByte(float temperature_C) {
  return static_cast<std::uint8_t>(std::lround(std::clamp((temperature_C - 20.0f) * 2, 0.0f, 255.0f)));
}

}  // namespace fulcrum::render
