// The paper's own model of cautery (its eq. 10 to 15), for comparison with the accurate one. Each equation, its
// corrections and what the paper leaves open: deploy/docs/measurements/thermal.
//
//   eq. 10, 14  conduction and sinks: HeatField with MakePaperMaterial
//   eq. 12      q = sigma |grad V|^2: Joule heat of the sheet's current, over its thickness
//   eq. 13      div grad V = 0 on a 256 x 256 texture around the tip, at a fixed voltage
//   node rule   a node whose texel passes the vaporisation threshold goes, at once and without latent heat
//
// With `as: printed` instead of the corrections:
//
//   Table 2     its numbers, in the only units in which they are consistent and near those of tissue (below)
//   eq. 11      conduction and source alone: no perfusion, no sink through the faces
//   eq. 13      sigma is that of the membrane everywhere: holes conduct
//   eq. 14      heat leaves through the sheet's border alone
//   node rule   edges at an invalid node live on at 0.7 of their rest length; with both ends invalid they go
#pragma once

#include <span>
#include <vector>

#include "services/base/core/scene_view.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/paper/texture_potential.h"
#include "thermal_node/topology/crumbs.h"
#include "thermal_node/topology/mesh_topology.h"

namespace fulcrum::thermal {

/// Table 2's diffusivity read in mm^2/s. As printed, in SI, it is some 4.5 million times that of tissue.
inline constexpr float kPaperDiffusivity_m2_s = 4.5f * 1.26e-7f;
/// Table 2 as printed: k [W/mK; "N/m2" there], rho [g/cm^3; "kg/m3"], c [J/gK; "J/kgK"], sigma [S/m]. In these units
/// k / (rho c) is 0.569 mm^2/s; in those of the table 0.569 m^2/s.
inline constexpr float kPrintedConductivity_W_mK = 0.512f, kPrintedDensity_g_cm3 = 3.0f,
                       kPrintedHeatCapacity_J_gK = 0.3f, kPrintedSigma_S_m = 0.9f;
/// Limit of the temperature of a texel [K]: between nodes that stay alive no loss or phase change would bound it, and
/// messages carry at most 3000 C.
inline constexpr float kPaperThetaMax = 2500.0f;
inline constexpr int kPaperSweeps = 32;  ///< Jacobi sweeps per frame; assumed, the paper does not state its number.

/// Constant material without water: nothing boils, the conductivities follow neither temperature nor dryness, no leak.
/// Throws InputError as MakeMaterial does.
[[nodiscard]] Material MakePaperMaterial(const ThermalParams& params);

class PaperModel {
 public:
  PaperModel(const SheetScene& scene, const Sheet& sheet);

  struct Electrode {
    Vec2f tip = Vec2f::Zero();  ///< Material coordinates [m].
    float radius_m = 0;
    float voltage_V = 0;
    bool tented = false;
  };
  /// Heats the texture around a tip that does not move during the step.
  void Heat(HeatField* field, const Electrode& electrode, float dt_s, Ledger* ledger);
  /// Applies the node rule. With a node all cells are removed that lie nearer to it than to its neighbours in the grid.
  [[nodiscard]] RemovedBox RemoveNodes(HeatField* field, MeshTopology* topology, Ledger* ledger);
  /// Eq. 14 as printed: (k grad T) . n + h (T - T_alpha) = 0 at the sheet's border. Does nothing with the corrections,
  /// in which both faces lose heat instead.
  void CoolBorder(HeatField* field, float dt_s, Ledger* ledger) const;

  /// For checkpoints: place of the texture, and its potential.
  [[nodiscard]] CellIndex corner() const { return corner_; }
  [[nodiscard]] std::span<const float> potential() const { return potential_.state(); }
  [[nodiscard]] std::span<float> potential() { return potential_.state(); }
  void set_corner(CellIndex corner) { corner_ = corner; }

 private:
  void MoveTo(CellIndex corner);
  void LoadTissue(const HeatField& field, int material);
  void FindBorder(const Sheet& sheet);
  void PlaceElectrode(const Sheet& sheet, const Electrode& electrode);
  [[nodiscard]] CellIndex CellOfNode(Index node) const;
  void TakeOutCellsOf(Index node, HeatField* field, Ledger* ledger, RemovedBox* removed) const;
  template <class Visit>
  void ForNeighbours(Index node, const Visit& visit) const;

  PaperForm as_;
  float h_border_W_m2K_;  ///< h of eq. 14, which is not printed: the scene's of the upper face.
  std::uint32_t rows_, cols_;
  int nx_, ny_;
  std::vector<Vec2f> node_;                   ///< Material position in cells from the sheet's origin.
  std::vector<Index> bin_offset_, bin_node_;  ///< Nodes by the tile of their cell.
  std::vector<Index> invalid_;                ///< Scratch.
  struct BorderCell {
    int cell;   ///< Within its tile.
    int faces;  ///< Towards the outside.
  };
  std::vector<std::vector<BorderCell>> border_;  ///< By tile; empty with the corrections.
  TexturePotential potential_;
  CellIndex corner_;
};

}  // namespace fulcrum::thermal
