// The atlas of the sheet's thermal state: one texel per 0.1 mm of material, four bytes as in a TemperaturePatch. Of the
// 4096 x 4096 texels that a patch's origin can address only the part that the sheet uses is stored. Pure.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// Texels, half open: [x, x + width) x [y, y + height).
struct AtlasRect {
  int x = 0, y = 0, width = 0, height = 0;
  [[nodiscard]] bool empty() const { return width <= 0 || height <= 0; }
  /// Smallest rectangle around both.
  [[nodiscard]] AtlasRect United(const AtlasRect& other) const;
};

class Atlas {
 public:
  /// Covers the material coordinates of `scene`; intact tissue at body temperature everywhere.
  explicit Atlas(const SceneView& scene);

  /// Copies the part of the patch that lies within the atlas. Returns the changed rectangle; empty if the patch is of
  /// another surface, has the wrong size or lies outside.
  AtlasRect Apply(const TemperaturePatch& patch);

  /// Draws slits from the first topology that is given where no patch has arrived yet, as after a restart of the
  /// renderer. Each cut triangle gets a capsule between the middles of its dead edges, with a browned rim. Later
  /// topologies paint nothing: the patches of what they have cut arrive as well, and would not correct a rim that
  /// reaches into a place without heat. Returns the changed rectangle.
  AtlasRect PaintCuts(const SceneView& scene, const TopologyState& topology);

  /// Sets the liquid in a cell of the film: blood and clot together, clot, water (geometry/sheet_fluid.h). It is
  /// independent of the patches. Returns whether it was another one. @pre the cell is part of the film.
  bool SetLiquid(int x, int y, std::uint8_t blood, std::uint8_t clot, std::uint8_t water);

  /// The film: kFilmBytes per 2 x 2 texels, row by row as the texels. First the thickness of blood and clot; second the
  /// nearness of removed tissue, 255 where there is some and 0 from kRim_m on; third that of the clot, last of the
  /// water. In a map of its own, because it is interpolated between texels, which may be removed on one side only.
  static constexpr int kFilmBytes = 4;
  [[nodiscard]] std::span<const std::uint8_t> film() const { return film_; }
  [[nodiscard]] int film_width() const { return film_width_; }
  [[nodiscard]] int film_height() const { return film_height_; }
  /// Thickness of blood and clot at (s, t) [m], 0 … 1; 0 outside the sheet.
  [[nodiscard]] float Blood(const Vec2f& material) const;
  /// Rectangle of the film, in its own units, that has changed since the last call.
  AtlasRect TakeFilmChange() { return std::exchange(film_change_, {}); }
  static constexpr float kRim_m = 0.0020f;

  /// Texel at (s, t) [m]; no value outside the sheet.
  [[nodiscard]] std::optional<std::array<std::uint8_t, 4>> At(const Vec2f& material) const;

  /// Whether the sheet is shown as removed at (s, t) [m]: the border lies between texels, as in the shaders.
  [[nodiscard]] bool Removed(const Vec2f& material) const;

  /// Nearness of removed tissue at (s, t) [m] as the shaders sample it: 1 there, 0 from kRim_m on.
  [[nodiscard]] float Nearness(const Vec2f& material) const;
  /// Number of texels that have been removed or, by a patch, restored: the same number, the same cuts.
  [[nodiscard]] std::uint64_t removals() const { return removals_; }
  /// Number of patches and paintings that have been applied: the same number, the same texels.
  [[nodiscard]] std::uint64_t patches() const { return patches_; }
  /// visit(x, y) for the squares of texels (x, y) to (x + 1, y + 1) in and beside the blocks with removed texels.
  template <class Visit>
  void ForEachSquareNearCuts(const Visit& visit) const {
    const int blocks_y = (height_ + kBlock - 1) / kBlock;
    const auto cut = [&](int bx, int by) {
      return bx < blocks_x_ && by < blocks_y && cut_[static_cast<std::size_t>(by * blocks_x_ + bx)] != 0;
    };
    for (int by = 0; by < blocks_y; ++by) {
      for (int bx = 0; bx < blocks_x_; ++bx) {
        // A square on the border of a block reaches into the next one.
        if (!cut(bx, by) && !cut(bx + 1, by) && !cut(bx, by + 1) && !cut(bx + 1, by + 1)) continue;
        for (int y = by * kBlock; y < std::min((by + 1) * kBlock, height_ - 1); ++y) {
          for (int x = bx * kBlock; x < std::min((bx + 1) * kBlock, width_ - 1); ++x) visit(x, y);
        }
      }
    }
  }

  /// True if tissue has been damaged or cut in the block of 16 x 16 texels at (s, t) [m].
  [[nodiscard]] bool Touched(const Vec2f& material) const;
  /// Number of blocks for which Touched() has become true.
  [[nodiscard]] std::uint64_t touches() const { return touches_; }

  /// False if anything within kReach_m of the rectangle from `low` to `high` [m] has looked otherwise than intact, dry
  /// tissue below 41 degrees: hot, damaged, dried, removed, or under blood, clot or water. It stays false.
  [[nodiscard]] bool Untouched(const Vec2f& low, const Vec2f& high) const;
  /// The same number, the same answers of Untouched().
  [[nodiscard]] std::uint64_t marks() const { return marks_; }
  static constexpr float kReach_m = 0.0026f;

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] float texel_m() const { return texel_m_; }
  /// 4 * width * height bytes, row by row, t slow and s fast.
  [[nodiscard]] std::span<const std::uint8_t> texels() const { return texels_; }

 private:
  static constexpr int kBlock = 16;  // Texels.
  [[nodiscard]] bool Covered(int x, int y) const;
  void MarkRim(int x, int y);
  void MarkRimsAgain(const AtlasRect& rect);
  void Touch(const AtlasRect& rect);
  void Mark(std::size_t block);
  AtlasRect PaintCapsule(const Vec2f& a, const Vec2f& b);

  float texel_m_;
  int width_;
  int height_;
  int blocks_x_;
  std::vector<std::uint8_t> texels_;
  int film_width_;
  int film_height_;
  std::vector<std::uint8_t> film_;
  AtlasRect film_change_;
  std::vector<std::uint8_t> covered_;  // Per block of kBlock x kBlock texels.
  std::vector<std::uint8_t> touched_;  // Per block.
  std::vector<std::uint8_t> cut_;      // Per block: texels have been removed.
  std::vector<std::uint8_t> marked_;   // Per block: not Untouched().
  std::uint64_t touches_ = 0, marks_ = 0;
  std::uint64_t removals_ = 0, patches_ = 0;
  bool painted_ = false;  // By PaintCuts().
};

}  // namespace fulcrum::render
