// Patterns of tissue, made once at start-up: sampling them costs a software rasteriser far less than computing noise
// for each pixel of each picture. All are seamlessly tileable, and the same in every run with the same seed. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// Square RGBA8 image of `size` texels: three independent smooth noises (red, green, blue; mean 128) that bend normals
/// and mottle colours, and lobules (alpha: 0 in the clefts, 255 in the middle of a lobule) for fat.
[[nodiscard]] std::vector<std::uint8_t> MakeNoisePattern(int size, std::uint32_t seed = 0);

/// Square one-byte image of `size` texels: small blood vessels that branch, 255 in the middle of a vessel.
[[nodiscard]] std::vector<std::uint8_t> MakeVesselPattern(int size, std::uint32_t seed = 0);

/// Square RGBA8 image of `size` texels: the three noises, and the vessels as alpha. One sample instead of two.
[[nodiscard]] std::vector<std::uint8_t> MakeSerosaPattern(int size, std::uint32_t seed = 0);

/// Map of ureter (red) and nerve (green) under the sheet, as they shine through it: two bytes per texel, s fast, over
/// the atlas' area. 255 on the centre line, 0 beyond twice the structure's radius.
struct StructureMap {
  int width = 1, height = 1;
  std::vector<std::uint8_t> texels;
};
[[nodiscard]] StructureMap MakeStructureMap(const SceneView& scene, float width_m, float height_m);

}  // namespace fulcrum::render
