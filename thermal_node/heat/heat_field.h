// Heat in the sheet: explicit finite volumes on sparse tiles in material space.
//
//   dH/dt = div(d k grad theta)/d - (loss) theta,   theta = H / rc(water),   water boils at theta_boil
//
// H is the sensible enthalpy. Boiling consumes the latent heat of the water irreversibly: the steam escapes and does
// not condense when the tissue cools, as it would in the usual enthalpy form.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "thermal_node/heat/ledger.h"
#include "thermal_node/heat/material.h"
#include "thermal_node/heat/sheet.h"
#include "thermal_node/heat/tile.h"

namespace fulcrum::thermal {

inline constexpr float kWakeTheta = 0.03f;   ///< Temperature at a tile's border that wakes the neighbour [K].
inline constexpr float kSleepTheta = 0.02f;  ///< A tile sleeps when its largest |theta| is below this [K].
/// A tile whose |theta| is below this is not drawn again until it sleeps [K]: a texel's step is 0.5 K.
inline constexpr float kVisibleTheta = 0.25f;
/// Largest dt * rate of an explicit stage; the maximum principle holds up to 1.
inline constexpr float kExplicitLimit = 0.98f;
/// Largest ratio of a fourth-order flux to the two-point flux: that of the shortest wave. Reduced where the step is too
/// long for it.
inline constexpr float kFluxGain = 4.0f / 3.0f;
inline constexpr float kResolvedGain = 7.0f / 6.0f;  ///< The same ratio for a wave of four cells.
/// Shear below this fraction of a face's conductance is neglected: no diagonal links.
inline constexpr float kShearIgnored = 1e-4f;
/// Maximum number of substeps of a step. If more are needed, the conductances of faces are limited to what these allow.
inline constexpr int kMaxSubsteps = 64;
/// Share of theta_boil from which on a cell with a part of its water counts as boiling: between two steps the tissue
/// beneath and a cold hook take a kelvin or two.
inline constexpr float kFrontTheta = 0.98f;
/// No front is nearer to a face than this share of a cell; less would cost substeps
/// (deploy/docs/measurements/thermal, Front of boiling).
inline constexpr float kLeastFrontDistance = 0.15f;
inline constexpr float kThetaPlausible = 5000.0f;  ///< Largest plausible |theta|; cells beyond it are quarantined [K].

/// Fills the tile's geometry from the sheet's metric.
void SetGeometry(const Sheet& sheet, Tile* tile);

class HeatField {
 public:
  /// One material for all sheets.
  HeatField(Sheet sheet, const Material& material);
  /// @pre as many materials as the sheet has, which differ in thickness, conductivities and losses only.
  HeatField(Sheet sheet, std::vector<Material> materials);

  [[nodiscard]] const Sheet& sheet() const { return sheet_; }
  /// The first one, for what all have in common; that of a place is Tile::material.
  [[nodiscard]] const Material& material() const { return materials_[0]; }
  [[nodiscard]] std::span<const Material> materials() const { return materials_; }
  /// Awake tiles by ascending index, so sums over them do not depend on the order of waking.
  [[nodiscard]] std::span<Tile* const> awake() const { return awake_; }
  [[nodiscard]] bool idle() const { return awake_.empty(); }

  /// Returns the tile, or nullptr if it was never awake or lies beyond the sheet.
  [[nodiscard]] Tile* Find(int tx, int ty) const;
  /// Wakes the tile and creates it on first use. Returns nullptr beyond the sheet.
  Tile* Wake(int tx, int ty);

  /// One step of conduction and losses, of second order in time, with boiling, waking of neighbours and sleeping of
  /// cold tiles. The number of substeps is chosen per island of awake tiles: enough for stability of its fastest tile
  /// and for accuracy in wet tissue. An island that would need more than kMaxSubsteps is stiff: the conductances of its
  /// fastest cells are limited to what the step allows and the sink is integrated exactly after the step. So the result
  /// stays within the bounds of the initial temperatures and conserves heat for any step length. Returns the largest
  /// number of substeps; that of a tile is in Tile::substeps.
  int Diffuse(float dt_s, Ledger* ledger);

  /// Recomputes theta, its sums and extremes from the enthalpy. Quarantines bad cells.
  void RefreshTheta(Tile* tile, Ledger* ledger);
  /// Converts enthalpy above boiling into evaporated water. Call after RefreshTheta.
  void Boil(Tile* tile, Ledger* ledger);
  /// Removes or quarantines a cell; its heat is added to `account` [J].
  void TakeOut(Tile* tile, int cell, CellFlag why, double* account);

  /// Takes out the cells whose damage is not finite (DamageModel::Update has returned false).
  void QuarantineBadDamage(Tile* tile, Ledger* ledger);

  /// Heat held by all awake tiles [J].
  [[nodiscard]] double Stored() const;
  /// Highest theta of awake tissue [K]; 0 when all sleep.
  [[nodiscard]] float MaxTheta() const;
  /// Number of steps of stiff islands since the start.
  [[nodiscard]] std::uint64_t stiff_steps() const { return stiff_steps_; }
  [[nodiscard]] std::uint64_t quarantined() const { return quarantined_; }
  /// Place of the last quarantined cell.
  [[nodiscard]] CellIndex last_quarantined() const { return last_quarantined_; }

  /// Tiles by index; null where none exists.
  [[nodiscard]] std::span<const std::unique_ptr<Tile>> tiles() const { return tiles_; }
  /// All tiles that exist, by ascending index.
  [[nodiscard]] std::vector<const Tile*> Existing() const;
  void Clear();
  /// Restores a tile from a checkpoint. @param held Tile::held, which a tile may keep from one step to the next.
  void Restore(int index, const TileState& state, bool held);
  void RestoreQuarantined(std::uint64_t count) { quarantined_ = count; }

 private:
  void BuildFaces(Tile* tile);
  void RebuildStaleFaces();
  /// Fills island_ with the awake tiles that faces join to the seed. A link across a corner is open only where one of
  /// the two other tiles at that corner is awake, so links join no islands that faces do not.
  void CollectIsland(Tile* seed);
  int DiffuseIsland(float dt_s, Ledger* ledger);
  void ExchangeHalos(Tile* tile);
  void LimitFaces(Tile* tile, float rate);
  struct StageOf {
    int index, count;
    float dt_s, gain;
    bool sink;  ///< The stage includes the losses.
    [[nodiscard]] bool last() const { return index + 1 == count; }
  };
  void RunStage(Tile* tile, const StageOf& stage, Ledger* ledger);
  void Cool(Tile* tile, float dt_s, Ledger* ledger) const;
  void ComputeResistance(Tile* tile);
  void ComputeMiddleTheta(Tile* tile) const;
  void WakeNeighbours();
  void SleepCold(Ledger* ledger);
  void MarkNeighboursStale(const Tile& tile);
  void Quarantine(Tile* tile, Ledger* ledger);
  Tile* Create(int index);
  /// Sink per kelvin [W/m^3K].
  [[nodiscard]] float SinkOf(const Tile& tile) const {
    return tile.state.tented != 0 ? tile.material->loss_tented : tile.material->loss_resting;
  }
  /// The tile and its eight neighbours, row by row; null where none of its material is awake.
  [[nodiscard]] std::array<const Tile*, 9> Around(const Tile& tile) const;

  Sheet sheet_;
  std::vector<Material> materials_;
  std::vector<std::unique_ptr<Tile>> tiles_;  ///< By index; null until first use.
  std::vector<Tile*> awake_;
  std::vector<Tile*> scratch_, island_;
  std::uint64_t quarantined_ = 0, stiff_steps_ = 0;
  CellIndex last_quarantined_;
};

}  // namespace fulcrum::thermal
