#include "services/session/assessment/damage_map.h"

#include <array>
#include <cstring>

namespace fulcrum::assessment {
namespace {

/// Value of a texel's damage, 255 (1 - exp(-Omega)), at which Omega of collagen is 1: the tissue is visibly blanched.
constexpr std::uint8_t kCoagulated = 162;
constexpr std::size_t kDamageByte = 1, kTexelBytes = 4;

/// Texels that are tested together, because nearly all of a patch is undamaged.
constexpr std::size_t kBlock = 8;

/// True when no texel of the block has a damage of 128 or more.
bool IsSound(const std::uint8_t* texels) {
  std::array<std::uint64_t, kBlock * kTexelBytes / sizeof(std::uint64_t)> words;
  std::memcpy(words.data(), texels, sizeof(words));
  std::uint64_t any = 0;
  for (const std::uint64_t word : words) any |= word;
  return (any & 0x0000800000008000u) == 0;
}
static_assert(kCoagulated >= 128 && kDamageByte == 1 && kPatchTexels % kBlock == 0);

}  // namespace

DamageMap::DamageMap(const SheetLine& line, double margin_m, double texel_m, const Eigen::AlignedBox2d& place)
    : line_(line), margin_m_(margin_m), texel_m_(texel_m), place_(place) {}

void DamageMap::Add(const TemperaturePatch& patch) {
  constexpr std::size_t kEdge = kPatchTexels;
  if (line_.empty() || patch.header.surface != BurntSurface::kMembrane ||
      patch.texels.size() != kTexelBytes * kEdge * kEdge || patch.header.origin_x > kAtlasTexels - kPatchTexels ||
      patch.header.origin_y > kAtlasTexels - kPatchTexels) {
    return;
  }
  if (damaged_.empty()) damaged_.assign(std::size_t{kAtlasTexels} * kAtlasTexels / 8, 0);
  for (std::size_t y = 0; y < kEdge; ++y) {
    const std::uint8_t* row = &patch.texels[kTexelBytes * kEdge * y + kDamageByte];
    const std::size_t first = (patch.header.origin_y + y) * kAtlasTexels + patch.header.origin_x;
    for (std::size_t x = 0; x < kEdge; ++x) {
      if (x % kBlock == 0 && IsSound(row - kDamageByte + kTexelBytes * x)) {
        x += kBlock - 1;
        continue;
      }
      if (row[kTexelBytes * x] < kCoagulated || TestBit(damaged_, first + x)) continue;
      SetBit(damaged_, first + x);
      const Eigen::Vector2d at = texel_m_ * Eigen::Vector2d(static_cast<double>(patch.header.origin_x + x) + 0.5,
                                                            static_cast<double>(patch.header.origin_y + y) + 0.5);
      beyond_ += place_.contains(at) && line_.Nearest(at).distance_m > margin_m_ ? 1 : 0;
    }
  }
}

double DamageMap::beyond_margin_m2() const { return static_cast<double>(beyond_) * texel_m_ * texel_m_; }

}  // namespace fulcrum::assessment
