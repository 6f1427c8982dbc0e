// A flat membrane without an organ, small enough to check by hand: node (r, c) at (c * h, r * h, 0), rim fixed.
#pragma once

#include <cstring>

#include "services/scene/format/scene_file.h"

namespace fulcrum::physics {

inline scene::SceneData SheetScene(std::uint32_t rows, std::uint32_t cols, float h = 0.002f) {
  scene::SceneData data;
  std::strncpy(data.fixed.name, "sheet", sizeof(data.fixed.name) - 1);
  data.fixed.hash = 42;
  data.fixed.membrane.rows = rows;
  data.fixed.membrane.cols = cols;
  data.fixed.tools[0] = {ToolKind::kGrasper, Vec3f(0, 0, 0.15f), 0.0025f, 0.3f, 0.0015f, 0.015f};
  data.fixed.tools[1] = {ToolKind::kHook, Vec3f(0, 0, 0.15f), 0.0025f, 0.3f, 0.0006f, 0.004f};
  const auto node = [cols](std::uint32_t r, std::uint32_t c) { return r * cols + c; };
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < cols; ++c) {
      data.rest_position.emplace_back(static_cast<float>(c) * h, static_cast<float>(r) * h, 0.0f);
      const bool rim = r == 0 || c == 0 || r + 1 == rows || c + 1 == cols;
      data.inverse_mass.push_back(rim ? 0.0f : 1.0f / (0.5f * h * h));
      data.membrane_material.emplace_back(static_cast<float>(c) * h, static_cast<float>(r) * h);
      const bool right = c + 1 < cols, down = r + 1 < rows;
      data.membrane_rest_length.push_back(right ? h : 0.0f);
      data.membrane_rest_length.push_back(down ? h : 0.0f);
      data.membrane_rest_length.push_back(right && down ? h * std::sqrt(2.0f) : 0.0f);
    }
  }
  // A hinge over each second diagonal of each second row; every constraint has a colour of its own.
  data.bending_colours.push_back(0);
  for (std::uint32_t r = 1; r + 2 < rows; r += 2) {
    for (std::uint32_t c = 1; c + 2 < cols; c += 2) {
      data.bending.push_back({{node(r, c), node(r + 1, c + 1), node(r + 1, c), node(r, c + 1)}, 0.0f});
      data.bending_colours.push_back(static_cast<Index>(data.bending.size()));
    }
  }
  return data;
}

}  // namespace fulcrum::physics
