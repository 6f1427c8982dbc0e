#include "render_node/geometry/atlas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr std::uint8_t kDamaged = 20;  // Damage below this value (of 255) is not visible.
// Up to these values of a texel (temperature, damage, dryness) membrane.frag draws intact tissue.
constexpr std::uint8_t kWarm = 42, kFaint = 12, kDry = 2;
// Half widths of a cut that is drawn from the topology: slit, charred, browned and blanched rim. Typical of an L-hook
// at 30 W on peritoneum (0.2-0.5 mm lateral damage).
constexpr float kSlit = 0.00030f;     // [m]
constexpr float kChar = 0.00045f;     // [m]
constexpr float kBrown = 0.00070f;    // [m]
constexpr float kBlanched = 0.0012f;  // [m]

float DistanceToSegment(const Vec2f& p, const Vec2f& a, const Vec2f& b) {
  const Vec2f ab = b - a;
  const float length2 = ab.squaredNorm();
  const float t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0f, 1.0f) : 0.0f;
  return (p - a - t * ab).norm();
}

constexpr int kFilmCell = 2;  // Texels in a cell of the film, in each direction.

void Raise(float value, std::uint8_t* byte) { *byte = std::max(*byte, static_cast<std::uint8_t>(std::lround(value))); }

/// 1 at `from`, 0 at `to`, linear between.
float Ramp(float value, float from, float to) { return std::clamp((to - value) / (to - from), 0.0f, 1.0f); }

}  // namespace

AtlasRect AtlasRect::United(const AtlasRect& other) const {
  if (empty()) {
    return other;
  }
  if (other.empty()) {
    return *this;
  }
  const int left = std::min(x, other.x), bottom = std::min(y, other.y);
  return {left, bottom, std::max(x + width, other.x + other.width) - left,
          std::max(y + height, other.y + other.height) - bottom};
}

Atlas::Atlas(const SceneView& scene) : texel_m_(scene.membrane.texel_m) {
  Vec2f extent = Vec2f::Zero();
  for (const Vec2f& m : scene.membrane_material) {
    extent = extent.cwiseMax(m);
  }
  const auto texels_of = [this](float metres) {
    return std::clamp(static_cast<int>(std::ceil(metres / texel_m_)) + 1, 1, kAtlasTexels);
  };
  width_ = texels_of(extent.x());
  height_ = texels_of(extent.y());
  film_width_ = (width_ + kFilmCell - 1) / kFilmCell;
  film_height_ = (height_ + kFilmCell - 1) / kFilmCell;
  film_.assign(std::size_t{kFilmBytes} * static_cast<std::size_t>(film_width_) * static_cast<std::size_t>(film_height_),
               0);
  blocks_x_ = (width_ + kBlock - 1) / kBlock;
  covered_.assign(static_cast<std::size_t>(blocks_x_) * ((height_ + kBlock - 1) / kBlock), 0);
  touched_ = cut_ = marked_ = covered_;
  const std::uint8_t body = TemperatureByte(scene.thermal.body_temperature_C);
  texels_.resize(4u * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  if (body > kWarm) std::ranges::fill(marked_, std::uint8_t{1});
  for (std::size_t i = 0; i < texels_.size(); i += 4) {
    texels_[i] = body;
    texels_[i + 1] = 0;
    texels_[i + 2] = 0;
    texels_[i + 3] = 255;
  }
}

AtlasRect Atlas::Apply(const TemperaturePatch& patch) {
  if (patch.header.surface != BurntSurface::kMembrane || patch.texels.size() != 4u * kPatchTexels * kPatchTexels ||
      patch.header.origin_x >= kAtlasTexels || patch.header.origin_y >= kAtlasTexels) {
    return {};
  }
  const int x = static_cast<int>(patch.header.origin_x), y = static_cast<int>(patch.header.origin_y);
  const AtlasRect rect{x, y, std::min(kPatchTexels, width_ - x), std::min(kPatchTexels, height_ - y)};
  if (rect.empty()) {
    return {};
  }
  bool restored = false;
  for (int row = 0; row < rect.height; ++row) {
    const std::uint8_t* after = patch.texels.data() + 4 * static_cast<std::size_t>(row) * kPatchTexels + 3;
    const std::uint8_t* before = texels_.data() + 4 * TexelIndex(x, y + row, width_) + 3;
    for (int column = 0; column < rect.width; ++column) {
      const bool removed = after[4 * column] < 128;
      if (removed == (before[4 * column] < 128)) continue;
      ++removals_;
      if (removed) MarkRim(x + column, y + row);
      restored = restored || !removed;
    }
    std::memcpy(texels_.data() + 4 * TexelIndex(x, y + row, width_),
                patch.texels.data() + 4 * static_cast<std::size_t>(row) * kPatchTexels,
                4 * static_cast<std::size_t>(rect.width));
  }
  if (restored) MarkRimsAgain(rect);
  for (int by = y / kBlock; by <= (y + rect.height - 1) / kBlock; ++by) {
    for (int bx = x / kBlock; bx <= (x + rect.width - 1) / kBlock; ++bx) {
      covered_[TexelIndex(bx, by, blocks_x_)] = 1;
    }
  }
  Touch(rect);
  return rect;
}

bool Atlas::SetLiquid(int x, int y, std::uint8_t blood, std::uint8_t clot, std::uint8_t water) {
  std::uint8_t* cell = &film_[kFilmBytes * TexelIndex(x, y, film_width_)];
  if (cell[0] == blood && cell[2] == clot && cell[3] == water) return false;
  cell[0] = blood;
  cell[2] = clot;
  cell[3] = water;
  if (blood != 0 || clot != 0 || water != 0) {
    Mark(TexelIndex(x * kFilmCell / kBlock, y * kFilmCell / kBlock, blocks_x_));
  }
  film_change_ = film_change_.United({x, y, 1, 1});
  return true;
}

float Atlas::Blood(const Vec2f& material) const {
  const float cell = kFilmCell * texel_m_;
  const int x = static_cast<int>(std::floor(material.x() / cell)),
            y = static_cast<int>(std::floor(material.y() / cell));
  if (x < 0 || y < 0 || x >= film_width_ || y >= film_height_) return 0;
  return static_cast<float>(film_[kFilmBytes * TexelIndex(x, y, film_width_)]) / 255;
}

float Atlas::Nearness(const Vec2f& material) const {
  const Vec2f place = (material / (kFilmCell * texel_m_)).array() - 0.5f;
  const auto x = static_cast<int>(std::floor(place.x())), y = static_cast<int>(std::floor(place.y()));
  const float right = place.x() - static_cast<float>(x), up = place.y() - static_cast<float>(y);
  const auto cell = [&](int column, int row) {
    const std::size_t at =
        TexelIndex(std::clamp(column, 0, film_width_ - 1), std::clamp(row, 0, film_height_ - 1), film_width_);
    return static_cast<float>(film_[kFilmBytes * at + 1]) / 255;
  };
  const float low = (1 - right) * cell(x, y) + right * cell(x + 1, y);
  const float high = (1 - right) * cell(x, y + 1) + right * cell(x + 1, y + 1);
  return (1 - up) * low + up * high;
}

/// Marks what lies beside the removed texel (x, y).
void Atlas::MarkRim(int x, int y) {
  const float cell = kFilmCell * texel_m_;
  const Vec2f texel((static_cast<float>(x) + 0.5f) * texel_m_, (static_cast<float>(y) + 0.5f) * texel_m_);
  const int reach = static_cast<int>(kRim_m / cell) + 1;
  const int x0 = std::max(0, x / kFilmCell - reach), x1 = std::min(film_width_ - 1, x / kFilmCell + reach);
  const int y0 = std::max(0, y / kFilmCell - reach), y1 = std::min(film_height_ - 1, y / kFilmCell + reach);
  for (int v = y0; v <= y1; ++v) {
    for (int u = x0; u <= x1; ++u) {
      const Vec2f p((static_cast<float>(u) + 0.5f) * cell, (static_cast<float>(v) + 0.5f) * cell);
      Raise(255 * Ramp((p - texel).norm(), 0, kRim_m), &film_[kFilmBytes * TexelIndex(u, v, film_width_) + 1]);
    }
  }
  film_change_ = film_change_.United({x0, y0, x1 - x0 + 1, y1 - y0 + 1});
}

/// Marks the rims around `rect` from the texels as they are: a slit that was drawn from the topology lies beside the
/// one of the patch.
void Atlas::MarkRimsAgain(const AtlasRect& rect) {
  const int reach = static_cast<int>(std::ceil(kRim_m / texel_m_)) + 2 * kFilmCell;
  const int x0 = std::max(0, rect.x - reach), x1 = std::min(width_, rect.x + rect.width + reach);
  const int y0 = std::max(0, rect.y - reach), y1 = std::min(height_, rect.y + rect.height + reach);
  for (int v = y0 / kFilmCell; v <= (y1 - 1) / kFilmCell; ++v) {
    for (int u = x0 / kFilmCell; u <= (x1 - 1) / kFilmCell; ++u) {
      film_[kFilmBytes * TexelIndex(u, v, film_width_) + 1] = 0;
    }
  }
  film_change_ = film_change_.United({x0 / kFilmCell, y0 / kFilmCell, (x1 - 1) / kFilmCell - x0 / kFilmCell + 1,
                                      (y1 - 1) / kFilmCell - y0 / kFilmCell + 1});
  for (int y = std::max(0, y0 - reach); y < std::min(height_, y1 + reach); ++y) {
    for (int x = std::max(0, x0 - reach); x < std::min(width_, x1 + reach); ++x) {
      if (texels_[4 * TexelIndex(x, y, width_) + 3] < 128) MarkRim(x, y);
    }
  }
}

std::optional<std::array<std::uint8_t, 4>> Atlas::At(const Vec2f& material) const {
  const int x = static_cast<int>(std::floor(material.x() / texel_m_));
  const int y = static_cast<int>(std::floor(material.y() / texel_m_));
  if (x < 0 || y < 0 || x >= width_ || y >= height_) {
    return std::nullopt;
  }
  std::array<std::uint8_t, 4> texel;
  std::copy_n(texels_.begin() + static_cast<std::ptrdiff_t>(4 * TexelIndex(x, y, width_)), 4, texel.begin());
  return texel;
}

bool Atlas::Removed(const Vec2f& material) const {
  const Vec2f place = (material / texel_m_).array() - 0.5f;  // The centre of texel 0 is at 0.
  const auto x = static_cast<int>(std::floor(place.x())), y = static_cast<int>(std::floor(place.y()));
  const float right = place.x() - static_cast<float>(x), up = place.y() - static_cast<float>(y);
  const auto alpha = [&](int column, int row) {
    return static_cast<float>(
        texels_[4 * TexelIndex(std::clamp(column, 0, width_ - 1), std::clamp(row, 0, height_ - 1), width_) + 3]);
  };
  const float low = (1 - right) * alpha(x, y) + right * alpha(x + 1, y);
  const float high = (1 - right) * alpha(x, y + 1) + right * alpha(x + 1, y + 1);
  return (1 - up) * low + up * high < 127.5f;
}

void Atlas::Touch(const AtlasRect& rect) {
  ++patches_;
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const std::uint8_t* texel = texels_.data() + 4 * TexelIndex(x, y, width_);
      const std::size_t block = TexelIndex(x / kBlock, y / kBlock, blocks_x_);
      std::uint8_t& touched = touched_[block];
      if (texel[3] < 128) cut_[block] = 1;
      if (texel[0] > kWarm || texel[1] > kFaint || texel[2] > kDry || texel[3] < 128) Mark(block);
      if (touched == 0 && (texel[1] >= kDamaged || texel[3] < 128)) {
        touched = 1;
        ++touches_;
      }
    }
  }
}

void Atlas::Mark(std::size_t block) {
  if (marked_[block] == 0) ++marks_;
  marked_[block] = 1;
}

bool Atlas::Untouched(const Vec2f& low, const Vec2f& high) const {
  const auto block_of = [this](float place, int texels) {
    return std::clamp(static_cast<int>(std::floor(place / texel_m_)), 0, texels - 1) / kBlock;
  };
  const int x0 = block_of(low.x() - kReach_m, width_), x1 = block_of(high.x() + kReach_m, width_);
  const int y0 = block_of(low.y() - kReach_m, height_), y1 = block_of(high.y() + kReach_m, height_);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      if (marked_[TexelIndex(x, y, blocks_x_)] != 0) return false;
    }
  }
  return true;
}

bool Atlas::Touched(const Vec2f& material) const {
  const int bx = static_cast<int>(material.x() / texel_m_) / kBlock;
  const int by = static_cast<int>(material.y() / texel_m_) / kBlock;
  const int blocks_y = (height_ + kBlock - 1) / kBlock;
  return touched_[TexelIndex(std::min(bx, blocks_x_ - 1), std::min(by, blocks_y - 1), blocks_x_)] != 0;
}

bool Atlas::Covered(int x, int y) const { return covered_[TexelIndex(x / kBlock, y / kBlock, blocks_x_)] != 0; }

AtlasRect Atlas::PaintCuts(const SceneView& scene, const TopologyState& topology) {
  const std::uint32_t cols = scene.membrane.cols;
  AtlasRect changed;
  if (std::exchange(painted_, true)) return changed;
  for (std::uint32_t row = 0; row + 1 < scene.membrane.rows; ++row) {
    for (std::uint32_t col = 0; col + 1 < cols; ++col) {
      for (int half = 0; half < 2; ++half) {
        const MembraneTriangle t = MembraneTriangleAt(cols, row, col, half);
        std::array<Vec2f, 3> middles;
        int count = 0;
        for (int k = 0; k < 3; ++k) {
          if (TestBit(topology.dead_edges, t.edges[k])) {
            middles[count++] =
                0.5f * (scene.membrane_material[t.nodes[k]] + scene.membrane_material[t.nodes[(k + 1) % 3]]);
          }
        }
        for (int k = 0; k + 1 < count; ++k) {
          changed = changed.United(PaintCapsule(middles[k], middles[k + 1]));
        }
      }
    }
  }
  return changed;
}

AtlasRect Atlas::PaintCapsule(const Vec2f& a, const Vec2f& b) {
  const Vec2f low = (a.cwiseMin(b).array() - kBlanched).matrix() / texel_m_;
  const Vec2f high = (a.cwiseMax(b).array() + kBlanched).matrix() / texel_m_;
  const int x0 = std::max(0, static_cast<int>(low.x())), x1 = std::min(width_ - 1, static_cast<int>(high.x()));
  const int y0 = std::max(0, static_cast<int>(low.y())), y1 = std::min(height_ - 1, static_cast<int>(high.y()));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      if (Covered(x, y)) {
        continue;
      }
      const Vec2f p((static_cast<float>(x) + 0.5f) * texel_m_, (static_cast<float>(y) + 0.5f) * texel_m_);
      const float d = DistanceToSegment(p, a, b);
      std::uint8_t* texel = texels_.data() + 4 * TexelIndex(x, y, width_);
      Raise(255 * Ramp(d, kBrown, kBlanched), texel + 1);
      Raise(128 * Ramp(d, kChar, kBrown) + 127 * Ramp(d, kSlit, kChar), texel + 2);
      if (d < kSlit && texel[3] >= 128) {
        texel[3] = 0;
        ++removals_;
        MarkRim(x, y);
      }
    }
  }
  const AtlasRect rect{x0, y0, x1 - x0 + 1, y1 - y0 + 1};
  Touch(rect);
  return rect;
}

}  // namespace fulcrum::render
