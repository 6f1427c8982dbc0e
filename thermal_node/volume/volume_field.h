// Heat and damage in the tissue beneath the sheet: explicit finite volumes on sparse bricks in material space.
//
//   rc dtheta/dt = div(k grad theta) - perfusion theta + q        z down from the sheet, k and rc by layer
//
// Boiling holds theta at 100 C until its latent heat is spent. Unlike in the sheet it is released on cooling: steam
// cannot escape from the depth and condenses there. Bottom and sides of the volume are insulated, so a burn is
// overestimated in depth; q is the heat of the leak current in the fat.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "services/base/core/hash.h"
#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/heat/sheet.h"
#include "thermal_node/volume/brick.h"
#include "thermal_node/volume/volume_ledger.h"

namespace fulcrum::thermal {

/// Thresholds of waking and sleeping. They are higher than the sheet's, because a brick costs as much as many tiles and
/// there is no damage below kDamageStart.
/// Temperature at a border that wakes the neighbour or enlarges the box [K].
inline constexpr float kVolumeWakeTheta = 0.75f;
inline constexpr float kVolumeSleepTheta = 0.5f;  ///< A brick sleeps when its largest |theta| is below this [K].

class VolumeField {
 public:
  VolumeField(const Sheet& sheet, const ThermalParams& params);

  [[nodiscard]] const VolumeMaterial& material() const { return material_; }
  [[nodiscard]] const Sheet& sheet() const { return sheet_; }
  [[nodiscard]] const VolumeLedger& ledger() const { return ledger_; }
  [[nodiscard]] bool idle() const { return awake_.empty(); }
  /// By ascending index.
  [[nodiscard]] std::span<Brick* const> awake() const { return awake_; }
  [[nodiscard]] int bricks_x() const { return bricks_x_; }
  [[nodiscard]] int brick_count() const { return static_cast<int>(bricks_.size()); }
  /// Returns the brick, or nullptr if it was never awake or lies beyond the sheet.
  [[nodiscard]] Brick* Find(int bx, int by) const;
  /// Wakes the brick and extends its box to the cells of `need`. Returns nullptr beyond the sheet.
  Brick* Wake(int bx, int by, const WarmBox& need);

  /// Adds the heat that the leak current deposits in duration_s beneath one cell of the sheet: q dt in the fat [J/m^3].
  /// Heat too small to wake sleeping tissue is left out.
  void AddSource(CellIndex cell, float heat_J_m3, float duration_s);

  /// Largest rate of an explicit step, lids included [1/s]; 0 if all bricks sleep.
  [[nodiscard]] float Rate() const;
  /// Wakes neighbours and extends boxes where the heat front is near a border.
  void Spread();
  /// One explicit step of all awake bricks with their lids and sources; requires dt * Rate() <= 1. Returns the heat
  /// conducted in through the lids [J].
  double Advance(float dt_s);
  /// Integrates damage at the present temperature over dt; then puts cold bricks to sleep.
  void Finish(float dt_s);

  /// Temperature above body at a depth below the sheet [K]; linear between layers.
  [[nodiscard]] float ThetaAt(const Vec2f& material, float depth_m) const;
  /// Depth down to which cells are dead (omega >= 1) below a place of the sheet [m]; 0 without dead cells.
  [[nodiscard]] float BurnDepth(const Vec2f& material) const;
  /// Largest burn depth of all places [m].
  [[nodiscard]] float deepest_burn_m() const { return deepest_burn_m_; }
  [[nodiscard]] float MaxTheta() const;
  /// Heat held by all awake bricks [J].
  [[nodiscard]] double Stored() const;
  [[nodiscard]] std::uint64_t quarantined() const { return quarantined_; }

  /// Adds sums of the warm state and the ledger to a hash; a difference in any cell changes them.
  void AddSums(Hash64* hash) const;

  /// What a checkpoint holds beside the bricks.
  struct Totals {
    VolumeLedger ledger;
    std::uint64_t quarantined = 0;
    float deepest_burn_m = 0;
    std::uint32_t brick_count = 0;  ///< That follow in the checkpoint.
  };
  [[nodiscard]] Totals totals() const;
  void RestoreTotals(const Totals& totals);
  /// A blank brick to fill from a checkpoint; FinishRestore when its enthalpy, damage and box are set.
  Brick* BeginRestore(int index);
  void FinishRestore(Brick* brick);
  void Clear();
  /// All bricks that are not blank, by ascending index.
  [[nodiscard]] std::vector<const Brick*> Existing() const;

 private:
  Brick* Create(int index);
  void Rouse(Brick* brick);
  static void Grow(Brick* brick, const WarmBox& need);
  [[nodiscard]] float BorderWeight(const Brick& brick, int dx, int dy) const;
  void FillHalos(Brick* brick) const;
  void StepBrick(Brick* brick, float dt_s);
  void RefreshBrick(Brick* brick);
  void Quarantine(Brick* brick);
  void Damage(Brick* brick, float dt_s);
  void SleepCold();
  [[nodiscard]] double StoredIn(const Brick& brick) const;
  [[nodiscard]] float BurnDepth(const Brick& brick, int column) const;

  const Sheet& sheet_;
  VolumeMaterial material_;
  DamageRate cell_death_;
  int bricks_x_ = 0, bricks_y_ = 0;
  std::vector<std::unique_ptr<Brick>> bricks_;  ///< By index; null until first use.
  std::vector<Brick*> awake_, scratch_;
  VolumeLedger ledger_;
  double lid_sum_ = 0;  ///< [K] of layer 0, in the present step.
  std::uint64_t quarantined_ = 0;
  float deepest_burn_m_ = 0;
};

}  // namespace fulcrum::thermal
