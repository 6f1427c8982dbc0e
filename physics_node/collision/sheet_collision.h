// Contact of a sheet with another sheet, and with itself if SheetPairs::kAll, for mode accurate. A sheet has two sides
// and is thin: a pair of a node and the triangle nearest to it keeps the side on which the node was found, so that
// nothing is pushed through. Row of node x against the point y = sum_i b_i x_i of the triangle, with its unit normal m
// and side s = +-1:
//
//   n . (x - y) >= c      n = (x - y) / |x - y| in front (s m . (x - y) > 0), else s m
//
//   c = min(t, largest distance since the pair was found)      t: sum of half the thicknesses [m]
//
// So sheets that begin nearer to each other than t, at rest or in a crumpled cut, push only once they have been apart.
// No pair: a node and a triangle within kNeighbourCells along the sheet and not across a cut; a node beside the rim of
// a sheet; a triangle that is turned over in its surroundings.
//
// The weights of a row sum up to zero, and so do its forces. Broad phase: sheet_patches.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/collision/contact_row.h"
#include "physics_node/collision/sheet_patches.h"
#include "physics_node/collision/tissue_collision.h"

namespace fulcrum::physics {

/// Which sheets are kept from passing through each other. A slack sheet that lies on itself wrinkles and does not come
/// to rest (deploy/docs/measurements/physics, Contact of sheets), so sessions have kBetweenSheets.
enum class SheetPairs : std::uint8_t { kNone, kBetweenSheets, kAll };

class SheetCollision {
 public:
  /// Bit in ContactRow.source that marks the rows of this class, beside that of all tissue.
  static constexpr std::uint32_t kSheetSource = 0x20000000u;
  /// Most rows in a substep. Assumed.
  static constexpr std::size_t kMaxRows = 4096;
  /// Coulomb's coefficient of wet serosa on serosa. Assumed.
  static constexpr float kFriction = 0.05f;
  /// Cells along the sheet within which a node and a triangle are neighbours.
  static constexpr std::uint32_t kNeighbourCells = 3;

  SheetCollision(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles);

  /// Once a step, before the solve; `moved` as in TissueCollision::FindPairs.
  void FindPairs(std::span<const float> moved);
  /// Finds the contacts of a substep that is `part` of the step, for JoinRows.
  void FindRows(float part);
  /// Appends them.
  void JoinRows(std::vector<ContactRow>* rows) const { rows->insert(rows->end(), rows_.begin(), rows_.end()); }
  /// After edits of the topology.
  void Follow() {
    patches_.Follow(model_->edited_edges());
    unsearched_ = true;
  }
  /// After a change of positions by something else than steps: forgets all pairs.
  void Restart();
  /// From the start. Without pairs nothing is searched and there are no rows.
  void Take(SheetPairs pairs) {
    pairs_ = pairs;
    patches_.WithinSheets(pairs == SheetPairs::kAll);
    Restart();
  }

  /// Nodes that have a triangle near them.
  [[nodiscard]] std::size_t pair_count() const { return watches_.size(); }
  /// Pairs of patches that may touch.
  [[nodiscard]] std::size_t patch_pair_count() const { return patches_.pair_count(); }

 private:
  /// A node near a triangle.
  struct Watch {
    Index node = 0, triangle = 0;  ///< Of the grid.
    Index patch = 0, other = 0;    ///< Patches of both.
    float side = 1;                ///< Of the triangle on which the node is.
    float distance = 0;            ///< t [m]
    float clearance = 0;           ///< c [m]
    float band = 0;                ///< Rows are made within this distance beyond c [m].
    bool blocks = false;           ///< Can make rows in this step.
    std::array<ParticleRef, 4> at;
  };
  struct Foot {
    std::array<float, 3> barycentric{};
    Vec3f offset = Vec3f::Zero();  ///< From the triangle to the node [m].
    Vec3f normal = Vec3f::Zero();  ///< Of the triangle; unit, or zero if it has no area.
    float distance_sq = 0;
    [[nodiscard]] bool OnEdge() const {
      return !(barycentric[0] > 0.0f && barycentric[1] > 0.0f && barycentric[2] > 0.0f);
    }
  };

  [[nodiscard]] std::uint32_t RowOf(Index triangle) const { return triangle / 2 / (cols_ - 1); }
  [[nodiscard]] std::uint32_t ColOf(Index triangle) const { return triangle / 2 % (cols_ - 1); }
  [[nodiscard]] Vec3f Node(Index node) const { return patches_.At(node / cols_, node % cols_); }
  [[nodiscard]] Foot FootOf(const Vec3f& p, Index triangle) const;
  [[nodiscard]] bool Exists(Index triangle) const {
    return exists_[triangle / 2] != 0 && model_->TriangleAlive(triangle);
  }
  /// Steps along the sheet from a node to a cell: 0 if it is a corner; kNoIndex: on another sheet.
  [[nodiscard]] std::uint32_t CellsBetween(Index node, std::uint32_t row, std::uint32_t col) const;
  [[nodiscard]] bool Joined(Index node, Index triangle) const;
  /// Mean normal of the sheet around a triangle, by area.
  [[nodiscard]] Vec3f NormalAround(Index triangle) const;
  [[nodiscard]] static bool PastRim(const Foot& foot);
  [[nodiscard]] bool TurnedOver(const Foot& foot, Index triangle) const;

  /// True: all pairs of patches that were due are searched.
  [[nodiscard]] bool SearchPairs();
  void Search(Index a, Index b);
  /// Nodes of one tile against cells of another, both with a cut in them or near; `reach` [m].
  void SearchTile(const SheetPatches::Tile& nodes, const SheetPatches::Tile& cells, bool cut, float reach);
  /// Two sheets cross here.
  [[nodiscard]] bool Crosses(Index node, const Foot& foot, float side, float distance) const;
  void TryWatch(Index node, Index triangle, const Foot& foot);
  [[nodiscard]] bool IsWatched(std::span<const Watch> watches, Index node, Index triangle) const;
  void DropRepeated(std::vector<Watch>* watches) const;
  void MergeFound();
  /// Sets what rows are made of from the nearest point.
  void Refresh(const Foot& foot, Watch* watch) const;
  void SetTriangle(Watch* watch, Index triangle) const;
  /// False: the pair ends.
  [[nodiscard]] bool Update(Watch* watch) const;
  [[nodiscard]] Foot Walk(Watch* watch, const Vec3f& p) const;

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  std::uint32_t cols_;
  std::vector<float> half_thickness_;  ///< By sheet [m].
  std::vector<std::uint8_t> exists_;   ///< By cell: part of a sheet.
  SheetPatches patches_;
  std::vector<Watch> watches_;  ///< Ordered by node.
  std::vector<Watch> found_;    ///< By the last search.
  std::vector<ContactRow> rows_;
  Index cursor_ = 0;        ///< Patch with which the next search begins.
  bool unsearched_ = true;  ///< Pairs of patches wait for their first search.
  SheetPairs pairs_ = SheetPairs::kBetweenSheets;
};

}  // namespace fulcrum::physics
