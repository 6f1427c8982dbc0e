// Patterns of tissue, made once at start-up: sampling them costs a software rasteriser far less than computing noise
// for each pixel of each picture. All are seamlessly tileable, and the same in every run with the same seed. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// Square RGBA8 image of `size` texels: three independent smooth noises (red, green, blue; mean 128) that bend normals
/// and mottle colours; alpha is 255.
[[nodiscard]] std::vector<std::uint8_t> MakeNoisePattern(int size, std::uint32_t seed = 0);

/// Square RGBA8 image of `size` texels: lobules of fat, kFatLobules a side. Red and green: slope of their surface along
/// s and t, 128 + 64 for a slope of 1 where the pattern is kFatPeriod_m long; blue: height, 0 in the deepest cleft and
/// 255 on the highest lobule; alpha: colour of the lobule, 128 to 255, and below that small vessels, 0 in the middle.
[[nodiscard]] std::vector<std::uint8_t> MakeFatPattern(int size, std::uint32_t seed = 0);
inline constexpr int kFatLobules = 8;
inline constexpr float kFatPeriod_m = 1 / 36.0f;  // As in fat.frag.

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
