// Heat in the sheet: explicit finite volumes on sparse tiles in material space.
//
//   dH/dt = div(d k grad theta)/d - (loss) theta,   theta = H / rc(water),   water boils at theta_boil
//
// H is the sensible enthalpy. Boiling spends the latent heat of the water for good: steam leaves, and tissue that cools
// does not get it back (the usual enthalpy form would let it condense again).
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

inline constexpr float kWakeTheta = 0.03f;      ///< A neighbour wakes when this warm at its border [K].
inline constexpr float kSleepTheta = 0.02f;     ///< A tile sleeps when nowhere warmer [K].
inline constexpr float kExplicitLimit = 0.98f;  ///< dt * rate of the explicit step; the maximum principle holds to 1.
/// Largest ratio of a fourth-order flux to the two-point one: that of the shortest wave. Where the step is too long for
/// it, what the step allows.
inline constexpr float kFluxGain = 4.0f / 3.0f;
inline constexpr float kResolvedGain = 7.0f / 6.0f;  ///< The same of a wave of four cells.
inline constexpr float kShearIgnored = 1e-4f;        ///< Of a face's conductance: no diagonal links.
/// Substeps of a step at most. Where these would not do, faces conduct no faster than they allow.
inline constexpr int kMaxSubsteps = 64;
inline constexpr float kThetaPlausible = 5000.0f;  ///< Beyond this a cell is bad, not hot [K].

/// Fills the tile's geometry from the sheet's metric.
void SetGeometry(const Sheet& sheet, Tile* tile);

class HeatField {
 public:
  HeatField(Sheet sheet, const Material& material);

  [[nodiscard]] const Sheet& sheet() const { return sheet_; }
  [[nodiscard]] const Material& material() const { return material_; }
  /// Awake tiles by ascending index: sums over them do not depend on the order of waking.
  [[nodiscard]] std::span<Tile* const> awake() const { return awake_; }
  [[nodiscard]] bool idle() const { return awake_.empty(); }

  /// The tile, or nullptr when it never was awake or lies beyond the sheet.
  [[nodiscard]] Tile* Find(int tx, int ty) const;
  /// Wakes (and on first use creates) the tile. nullptr beyond the sheet.
  Tile* Wake(int tx, int ty);

  /// One step of conduction and losses, of second order in time, with boiling, waking of neighbours and sleeping of
  /// cold tiles. Each island of awake tiles takes as many substeps as its fastest tile needs to be stable and wet
  /// tissue to be accurate. One that would need more than kMaxSubsteps is stiff: cells that are too fast for it conduct
  /// as fast as it allows and the sink is taken exactly, after the step. So it stays bounded by what was there and
  /// conserves heat, whatever the step's length. Returns the largest number of substeps; that of a tile is in
  /// Tile::substeps.
  int Diffuse(float dt_s, Ledger* ledger);

  /// Recomputes theta, its sums and extremes from the enthalpy. Quarantines bad cells.
  void RefreshTheta(Tile* tile, Ledger* ledger);
  /// Spends heat above boiling on water [call after RefreshTheta].
  void Boil(Tile* tile, Ledger* ledger);
  /// Takes a cell out; its heat goes to `account`.
  void TakeOut(Tile* tile, int cell, CellFlag why, double* account);

  /// Heat held by all awake tiles [J].
  [[nodiscard]] double Stored() const;
  /// Highest theta of awake tissue [K]; 0 when all sleep.
  [[nodiscard]] float MaxTheta() const;
  /// Steps of islands that were stiff.
  [[nodiscard]] std::uint64_t stiff_steps() const { return stiff_steps_; }
  [[nodiscard]] std::uint64_t quarantined() const { return quarantined_; }
  /// Where the last quarantined cell was.
  [[nodiscard]] CellIndex last_quarantined() const { return last_quarantined_; }

  /// All tiles that exist, by index; null where none does.
  [[nodiscard]] std::span<const std::unique_ptr<Tile>> tiles() const { return tiles_; }
  /// All tiles that exist, by ascending index.
  [[nodiscard]] std::vector<const Tile*> Existing() const;
  void Clear();
  /// Puts back a tile from a checkpoint.
  void Restore(int index, const TileState& state);
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
    bool sink;  ///< Losses are part of it.
    [[nodiscard]] bool last() const { return index + 1 == count; }
  };
  void RunStage(Tile* tile, const StageOf& stage, Ledger* ledger);
  void Cool(Tile* tile, float dt_s, Ledger* ledger) const;
  void ComputeConductivity(Tile* tile);
  void ComputeMiddleTheta(Tile* tile) const;
  void WakeNeighbours();
  void SleepCold(Ledger* ledger);
  void MarkNeighboursStale(const Tile& tile);
  void Quarantine(Tile* tile, Ledger* ledger);
  Tile* Create(int index);
  /// [W/m^3K]
  [[nodiscard]] float SinkOf(const Tile& tile) const {
    return tile.state.tented != 0 ? material_.loss_tented : material_.loss_resting;
  }
  /// The tile and its neighbours, row by row; null where none is awake.
  [[nodiscard]] std::array<const Tile*, 9> Around(const Tile& tile) const;

  Sheet sheet_;
  Material material_;
  std::vector<std::unique_ptr<Tile>> tiles_;  ///< By index; null until first use.
  std::vector<Tile*> awake_;
  std::vector<Tile*> scratch_, island_;
  std::uint64_t quarantined_ = 0, stiff_steps_ = 0;
  CellIndex last_quarantined_;
};

}  // namespace fulcrum::thermal
