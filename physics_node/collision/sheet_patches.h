// Broad phase of contact between sheets, and of a sheet with itself if that is wanted: which patches of cells may
// touch.
//
// A sheet is divided into patches. Two patches that do not adjoin keep a room to move: at an evaluation the distance of
// their boxes, less the reach of the search, is divided between them by their speeds, and neither is evaluated again
// before it has used its share. So for every such pair, with movement m since the evaluation,
//
//   room_a - m_a + room_b - m_b <= gap - reach
//
// Patches that adjoin, and a patch with itself, can touch only where the sheet is folded back or cut:
//
//   angle(axis_a, axis_b) + half_a + half_b >= 150 degrees       axis, half: a cone around the patch's normals
//
// A flat sheet thus costs a sum per patch and step. Pairs that may touch are searched when they have moved by
// kSearchTravel. Everything is serial and in fixed order: no result depends on threads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/sheets.h"

namespace fulcrum::physics {

class SheetPatches {
 public:
  /// Cells along a side of a tile: the unit of the search. A patch has whole tiles.
  static constexpr std::uint32_t kTileCells = 4;
  /// Movement of a pair of patches between two searches [m].
  static constexpr float kSearchTravel = 0.0005f;
  /// The next step can be faster than the last one by this factor.
  static constexpr float kFaster = 1.5f;

  /// A rectangle of nodes of one sheet, ends included.
  struct Area {
    std::uint32_t row0 = 0, row1 = 0, col0 = 0, col1 = 0;
  };
  struct Box {
    Vec3f low = Vec3f::Constant(kNowhere), high = Vec3f::Constant(-kNowhere);
    /// Squared distance [m^2]; large if one is empty.
    [[nodiscard]] float DistanceSq(const Box& other) const {
      return (low - other.high).cwiseMax(other.low - high).cwiseMax(0.0f).squaredNorm();
    }
    [[nodiscard]] float DistanceSq(const Vec3f& p) const {
      return (low - p).cwiseMax(p - high).cwiseMax(0.0f).squaredNorm();
    }
  };
  /// Contains the normals of an area.
  struct Cone {
    Vec3f axis = Vec3f::UnitZ();
    float cos_half = 1, sin_half = 0;
    bool wide = false;  ///< Of more than 150 degrees across, or unknown.
    /// The normals of both are so different that the areas may face each other.
    [[nodiscard]] bool Faces(const Cone& other) const;
  };
  struct Tile {
    Area area;
    std::uint32_t row_end = 0, col_end = 0;  ///< Its own nodes are before these: each node belongs to one tile.
    Box box;
    Cone cone;
    bool cut = false;  ///< An edge of it, or one that ends in it, is severed.
  };
  /// Two patches that may touch, the first with the lower or the same number.
  struct Pair {
    Index other = 0;
    float moved = 0;    ///< Since the last search [m].
    bool fresh = true;  ///< Not searched yet.
    bool adjoins = false;
  };

  /// `distance`: largest distance at which sheets touch [m].
  SheetPatches(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles, float distance);

  /// Whether patches of one sheet are pairs as well; no before the first call. To be followed by Restart.
  void WithinSheets(bool within) { within_ = within; }
  /// Once a step: finds the pairs. `moved` as in TissueCollision::FindPairs.
  void Move(std::span<const float> moved);
  /// After a change of any position that is not in Move's argument.
  void Restart();
  /// After edits of the topology.
  void Follow(std::span<const Index> edited_edges);

  [[nodiscard]] Index count() const { return static_cast<Index>(patches_.size()); }
  [[nodiscard]] std::size_t pair_count() const { return pair_count_; }
  /// Boxes farther apart than this are not searched [m].
  [[nodiscard]] float reach() const { return reach_; }
  [[nodiscard]] std::vector<Pair>& pairs(Index patch) { return patches_[patch].pairs; }
  /// Movement in this step [m].
  [[nodiscard]] float step(Index patch) const { return step_[patch]; }
  /// Any node moves in this step.
  [[nodiscard]] bool moving() const { return moving_; }
  /// The patch of a node of a sheet.
  [[nodiscard]] Index Of(std::uint32_t row, std::uint32_t col) const;
  [[nodiscard]] std::size_t SheetOf(std::uint32_t row) const { return sheet_of_row_[row]; }
  /// Tiles of a patch as they are in this step.
  [[nodiscard]] std::span<const Tile> Tiles(Index patch);
  /// Tiles of one sheet that share a node or are the same.
  [[nodiscard]] static bool Adjoin(const Tile& a, const Tile& b) {
    return a.area.row0 <= b.area.row1 && b.area.row0 <= a.area.row1 && a.area.col0 <= b.area.col1 &&
           b.area.col0 <= a.area.col1;
  }
  /// False: the boxes of this pair, fitted anew, are too far apart; it is no pair any more, the caller removes it.
  [[nodiscard]] bool StaysClose(Index a, const Pair& pair);
  void RemovePair(Index a, std::size_t at);

  [[nodiscard]] Vec3f At(std::uint32_t row, std::uint32_t col) const {
    return particles_->At(particles_->NodeRef(row, col));
  }
  [[nodiscard]] bool Alive(std::uint32_t row, std::uint32_t col) const {
    const Index node = row * cols_ + col;
    return model_->NodeAlive(node) && !model_->IsDebris(node);
  }

 private:
  /// Where empty boxes are [m].
  static constexpr float kNowhere = 1e3f;
  struct Patch {
    Area area;
    std::uint32_t strip = 0;             ///< Patches of the same rows of nodes.
    std::uint32_t lane0 = 0, lane1 = 0;  ///< Of its columns.
    Cone cone;
    bool cut = false;
    float turned = 0;              ///< Movement since the cone was fitted [m].
    std::uint32_t tiles_step = 0;  ///< In which the tiles were fitted.
    std::vector<Tile> tiles;
    std::array<Index, 9> adjoining;  ///< Itself and its neighbours, ascending; the rest kNoIndex.
    std::vector<Pair> pairs;
  };
  struct Sheet {
    std::uint32_t first_row = 0, rows = 0, cols = 0, patch_rows = 0, patch_cols = 0;
    Index first_patch = 0;
  };

  void MakePatches(const Sheet& sheet);
  [[nodiscard]] Box FitBox(const Area& area) const;
  [[nodiscard]] Cone FitCone(const Area& area) const;
  void Fit(Index patch);
  void Evaluate(Index patch);
  void FindFolds(Index patch);
  /// False: there are too many pairs.
  bool Keep(Index a, Index b, bool adjoins);
  void Drop(Index a, Index b);

  const TissueModel* model_;
  const ParticleStore* particles_;
  std::uint32_t cols_, cells_ = 2 * kTileCells;  ///< Cells along a side of a patch.
  float reach_;                                  ///< Boxes farther apart than this are not searched [m].
  std::vector<Sheet> sheets_;
  std::vector<std::size_t> sheet_of_row_;
  std::vector<Area> strips_;
  std::vector<std::array<float, ParticleStore::kBlocksPerRow>> strip_moved_;
  std::vector<Patch> patches_;
  std::vector<std::uint8_t> edited_;  ///< By patch: an edge of it was severed in this call of Follow.
  /// By patch: boxes, movement since they were fitted, in this step, and room to move [m].
  std::array<std::vector<float>, 3> low_, high_;
  std::vector<float> age_, step_, room_, gap_;
  std::size_t pair_count_ = 0;
  std::uint32_t steps_ = 1;
  bool moving_ = false, within_ = false;
};

}  // namespace fulcrum::physics
