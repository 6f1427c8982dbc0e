// Liquid on the sheet: blood and irrigation fluid run downhill, gather in hollows with a level surface, clot, are
// washed off and aspirated. A thin film on cells of 2 x 2 cells of the atlas' film (0.4 mm): between two neighbours
// flows
//
//   q = g m^3 S / (3 nu)   [m^2/s], m = thickness above what wets the tissue, S = slope of the liquid's surface,
//
// the lubrication approximation (e.g. Oron, Davis and Bankoff, Rev. Mod. Phys. 69, 931, 1997), limited so that a cell
// gives at most a fifth of m to each neighbour in a step. Where the surface is level nothing flows, which makes pools.
// What leaves a cell enters another one or is counted, so that volume is conserved. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/membrane_mesh.h"
#include "services/base/core/suction.h"

namespace fulcrum::render {

/// A suction and irrigation tube at work, frame W.
struct WorkingTube {
  TubeFlow flow = TubeFlow::kNone;
  Vec3f tip_W = Vec3f::Zero();    ///< Its open end [m].
  Vec3f axis_W = Vec3f::UnitZ();  ///< Unit vector of its shaft, out of the open end.
  float radius_m = 0.0025f;
};

class SheetFluid {
 public:
  /// @param rim of SheetRim(): a side that tissue continues holds the liquid back, over others it runs off. Empty: all
  /// sides are free. Keeps references to the arrays of `scene` and `rim`.
  SheetFluid(const SceneView& scene, std::span<const float> rim) : scene_(scene), rim_(rim) {}

  static constexpr double kStep_s = 0.02;

  /// Adds blood around (s, t) [m]. Returns the volume that was added: 0 beside the sheet [m^3].
  double Bleed(const Vec2f& material, double volume_m3);

  /// Takes the present shape of the sheet and, from its atlas, where it is cut: there liquid lies in the slit, kSlit_m
  /// lower. Both must outlive the calls of Step. Without an atlas nothing is cut.
  void SetShape(const MembraneMesh& membrane, const Atlas* atlas = nullptr);
  static constexpr float kSlit_m = 0.0012f;  ///< Assumed: what is bared lies so far below the sheet.

  /// One step of kStep_s. @pre SetShape has been called since the last Bleed on a dry sheet.
  void Step(std::span<const WorkingTube> tubes);
  /// Lets blood clot and water be absorbed for so long; apart from Step, because it is slow.
  void Age(double seconds);

  /// Writes what has changed since the last call to the film of `atlas`. Returns whether that was anything.
  bool Show(Atlas* atlas);

  [[nodiscard]] bool dry() const { return wet_.empty(); }  ///< Nothing lies on the sheet, not even clots.
  [[nodiscard]] bool flows() const { return flows_; }      ///< Liquid has moved in the last step.
  /// Liquid that clots or is absorbed.
  [[nodiscard]] bool ages() const { return ages_; }

  /// Where the blood is, or has gone [m^3]; their sum is what Bleed has added.
  struct Balance {
    double liquid = 0, clotted = 0, aspirated = 0, ran_off = 0;
    [[nodiscard]] double sum() const { return liquid + clotted + aspirated + ran_off; }
  };
  [[nodiscard]] Balance blood() const;

  /// Thickness at (s, t) [m]: liquid blood, water, clot. 0 beside the sheet.
  struct Column {
    float blood = 0, water = 0, clot = 0;
    [[nodiscard]] float liquid() const { return blood + water; }
  };
  [[nodiscard]] Column At(const Vec2f& material) const;

  /// Thickness that a full byte of the film stands for: blood and clot together, clot, water [m].
  static constexpr float kFullBlood_m = 0.0006f, kFullClot_m = 0.0006f, kFullWater_m = 0.0006f;

 private:
  /// Index of a cell, row by row; cells of a border around the sheet, beside all that it has, are no tissue.
  using Cell = std::uint32_t;
  /// Place of a cell's middle in a triangle of the grid.
  struct Anchor {
    Triangle nodes{kNoIndex, 0, 0};
    float b1 = 0, b2 = 0;
  };
  void MakeCells();
  [[nodiscard]] Cell CellOf(int x, int y) const;
  [[nodiscard]] Cell CellAt(const Vec2f& material) const;  ///< kNoIndex: beside the sheet.
  [[nodiscard]] bool Tissue(Cell cell) const { return anchors_[cell].nodes[0] != kNoIndex; }
  [[nodiscard]] std::array<Cell, 4> Neighbours(Cell cell) const;
  void Wet(Cell cell);
  void Changed(Cell cell);
  void FindShape(Cell cell);
  void FindShapeAround(Cell cell);
  void Flow();
  [[nodiscard]] bool HeldAtRim(Cell cell) const;
  void DropDry();
  void Spill(Cell cell, float share);
  void Aspirate(const WorkingTube& tube);
  void Irrigate(const WorkingTube& tube);
  [[nodiscard]] Index NodeAhead(const WorkingTube& tube) const;
  [[nodiscard]] double VolumeOf(float thickness) const {
    return static_cast<double>(thickness) * static_cast<double>(cell_m_) * static_cast<double>(cell_m_);
  }

  SceneView scene_;
  std::span<const float> rim_;
  float cell_m_ = 0;
  int width_ = 0, height_ = 0;  // In cells, without the border; 0: nothing has been wet yet, and nothing is allocated.
  std::vector<Anchor> anchors_;
  std::vector<Column> columns_;
  std::vector<Vec3f> place_;          // Of the tissue under a cell, frame W; known where it is wet, and beside that.
  std::vector<float> steepness_;      // |z of its normal|, at least kSteepest.
  std::vector<float> rough_;          // Its unevenness [m]; NaN: not known yet.
  std::vector<float> level_;          // z of the liquid's surface [m].
  std::vector<float> rested_z_;       // z of the place when all came to rest; known where it was wet then [m].
  std::vector<std::uint32_t> of_;     // Shape for which the place is known: the value of shape_.
  std::vector<std::uint8_t> is_wet_;  // In wet_.
  std::vector<Cell> wet_;
  const MembraneMesh* sheet_ = nullptr;
  const Atlas* atlas_ = nullptr;
  std::uint32_t shape_ = 0;
  AtlasRect changed_;  // In cells.
  bool flows_ = false, ages_ = false;
  double aspirated_m3_ = 0, ran_off_m3_ = 0;
  struct Transfer {
    Cell from, to;  // kNoIndex: off the sheet.
    float blood, water;
  };
  std::vector<Transfer> transfers_;  // Scratch.
};

}  // namespace fulcrum::render
