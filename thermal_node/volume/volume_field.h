// Heat and damage in the tissue beneath the sheet: explicit finite volumes on sparse bricks in material space.
//
//   rc dtheta/dt = div(k grad theta) - perfusion theta + q        z down from the sheet, k and rc by layer
//
// Boiling holds theta at 100 C until its latent heat is spent. Unlike in the sheet it is given back on cooling: steam
// cannot leave the depth and condenses there. No heat leaves below the volume or at its sides, which errs on the side
// of too deep a burn; q is the leak current's heat in the fat.
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

/// Wider than the sheet's: a brick costs as much as many tiles, and no damage comes below kDamageStart.
inline constexpr float kVolumeWakeTheta = 0.75f;  ///< A neighbour wakes, a box grows when this warm at its border [K].
inline constexpr float kVolumeSleepTheta = 0.5f;  ///< A brick sleeps when nowhere warmer [K].

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
  /// The brick, or nullptr when it never was awake or lies beyond the sheet.
  [[nodiscard]] Brick* Find(int bx, int by) const;
  /// Wakes the brick with at least the cells of `need` in its box. nullptr beyond the sheet.
  Brick* Wake(int bx, int by, const WarmBox& need);

  /// Adds heat of the leak current beneath one cell of the sheet: q dt in the fat [J/m^3], come in duration_s. Too
  /// little to wake sleeping tissue is left out.
  void AddSource(CellIndex cell, float heat_J_m3, float duration_s);

  /// Largest rate of an explicit step that the lids may have, too [1/s]. 0 when all sleep.
  [[nodiscard]] float Rate() const;
  /// Wakes neighbours and grows boxes where the front comes near.
  void Spread();
  /// One explicit step of all awake bricks with their lids and sources, dt * Rate() <= 1. Returns the heat that came in
  /// through the lids [J].
  double Advance(float dt_s);
  /// Damage at the present temperature over dt; then cold bricks fall asleep.
  void Finish(float dt_s);

  /// Temperature above body at a depth below the sheet [K]; linear between layers.
  [[nodiscard]] float ThetaAt(const Vec2f& material, float depth_m) const;
  /// How deep cells are dead (omega >= 1) below a place of the sheet [m]; 0: nowhere.
  [[nodiscard]] float BurnDepth(const Vec2f& material) const;
  /// The same at the worst place of all.
  [[nodiscard]] float deepest_burn_m() const { return deepest_burn_m_; }
  [[nodiscard]] float MaxTheta() const;
  /// Heat held by all awake bricks [J].
  [[nodiscard]] double Stored() const;
  [[nodiscard]] std::uint64_t quarantined() const { return quarantined_; }

  /// Adds sums of the warm state and the ledger: a difference in any cell changes them.
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
