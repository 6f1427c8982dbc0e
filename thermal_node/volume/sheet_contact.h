// Heat exchange between the sheet's cells and the columns of the volume beneath them.
//
// Two columns lie under three cells of the sheet, along s and along t. Each pair of a cell and a column exchanges g A
// (theta_cell - theta_column), A the area they share, g the conductance of half the sheet and half a layer in series
// [W/m^2K]. So temperatures stay within their initial bounds and heat is conserved. There is no contact at holes, where
// the sheet is tented, and beneath a sheet that is spanned freely.
#pragma once

#include <span>

#include "thermal_node/heat/heat_field.h"
#include "thermal_node/volume/volume_field.h"

namespace fulcrum::thermal {

class SheetContact {
 public:
  SheetContact(std::span<const Material> sheets, const VolumeMaterial& volume);
  SheetContact(const Material& sheet, const VolumeMaterial& volume) : SheetContact(std::span(&sheet, 1), volume) {}

  /// One step of the volume with its contact to the sheet, in substeps that the larger rate of both requires. The heat
  /// conducted downward is booked as lost in the sheet's ledger. Returns the number of substeps; 0 if all is cold.
  int Step(float dt_s, HeatField* sheet, VolumeField* volume, Ledger* ledger) const;

 private:
  /// Warm tissue on one side wakes the other.
  void Wake(HeatField* sheet, VolumeField* volume) const;
  void WakeSheetAbove(const Brick& brick, HeatField* sheet) const;
  /// Takes dt of heat from or to the sheet above the brick and sets the brick's lid to match.
  void Exchange(float dt_s, HeatField* sheet, const VolumeMaterial& volume, Brick* brick) const;
  /// g of a cell of the sheet [W/m^2K].
  [[nodiscard]] float Conductance(const Tile& tile, int cell) const;

  float half_layer_ = 0;  ///< Resistance of half a layer of the volume [m^2K/W].
  float rate_ = 0;        ///< Largest rate of the exchange for a cell of the sheet [1/s].
};

}  // namespace fulcrum::thermal
