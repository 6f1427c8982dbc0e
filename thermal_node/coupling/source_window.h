// Current and Joule heat around the tip: a 64 x 64 copy of the cells, advanced from event to event.
//
// A potential is valid until the tissue changes. So after each solve the step goes to the earliest moment at which a
// cell has spent its water (or has warmed by more than kMaxWarming), within [min_step, rest]; the tip is taken at
// mid-step. A fixed step of a frame would be wrong by about the whole energy (lab notes).
#pragma once

#include <array>
#include <cstdint>

#include "thermal_node/coupling/generator.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/potential/potential_solver.h"

namespace fulcrum::thermal {

inline constexpr float kMaxWarming = 20.0f;  ///< Per coupling step [K]: sigma then changes by less than 30 %.
inline constexpr float kMaxWay = 0.26f;      ///< Of the tip in a coupling step [cells]: 5 mm/s in half a frame.
/// Corner of a window that has not been used yet: far from any sheet, yet no overflow in differences.
inline constexpr CellIndex kNowhere{-(1 << 24), -(1 << 24)};
inline constexpr float kTentRadius_m = 0.015f;  ///< A tented sheet returns its current to the tissue from here on.

/// Tip path over a span of time, in material space.
struct TipPath {
  Vec2f from = Vec2f::Zero(), to = Vec2f::Zero();  ///< [m]
  Vec2f half = Vec2f::Zero();  ///< From the tip to either end of the line of metal that touches [m].
  float radius_m = 0;          ///< Around that line.
  bool tented = false;
};

/// Accumulated over Run() calls until ClearStats().
struct SourceStats {
  int solves = 0, iterations = 0;
  int removed_cells = 0;
  CellIndex low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};  ///< Box of the removed cells.
  float voltage_V = 0, current_A = 0;                               ///< Of the last solve.
  float imbalance = 0;                                              ///< Largest.
};

class SourceWindow {
 public:
  SourceWindow(const Material& material, const Sheet& sheet);

  /// Heats the sheet for `duration_s` while the tip moves along the path.
  void Run(HeatField* field, const TipPath& path, const Drive& drive, float duration_s, Ledger* ledger);

  /// Time integral of the squared potential against the tissue beneath, over the last Run [V^2 s]; cell (i, j) of the
  /// window at j * kWindow + i, cell (0, 0) at corner(). 0 where nothing leaks: holes, a tented sheet. Only kept when
  /// asked for.
  [[nodiscard]] const std::array<float, kWindowCells>& leak_V2s() const { return leak_V2s_; }
  [[nodiscard]] CellIndex corner() const { return corner_; }
  void KeepLeak() { keep_leak_ = true; }

  [[nodiscard]] const SourceStats& stats() const { return stats_; }
  void ClearStats() { stats_ = {}; }

  /// Shortest coupling step, unless the tip moves more than kMaxWay in it. See thermal.coupling_error_pct.
  float min_step_s = 2.0e-3f;
  float tolerance = 1e-2f;  ///< Of the potential, energy norm; 1e-3 changes the energy of a cut by less than 0.1 %.

  /// For checkpoints: where the window stood and the start value of the next solve.
  struct State {
    CellIndex corner = kNowhere;
    std::array<float, kWindowCells> start{};
  };
  void Export(State* state) const;
  void Import(const State& state);

 private:
  void MoveTo(CellIndex corner);
  void RefreshTiles(HeatField* field, Ledger* ledger);
  void Load(HeatField* field, Ledger* ledger);
  /// The tissue in the window lies as it does under the tip: tented or not.
  void Store(HeatField* field, bool tented);
  void SetGround(const Vec2f& middle, bool tented);
  void SetContact(const Vec2f& tip, const Vec2f& half, float radius_m, float arc_m);
  void SetSigma();
  [[nodiscard]] float TimeToEvent(float v2) const;
  void Deposit(float v2, float dt_s, float remove_theta, Ledger* ledger);
  void AddLeak(float v2, float dt_s);
  void BoilRow(int j, float remove_theta, Ledger* ledger);
  template <class Visit>
  void ForTileRows(HeatField* field, const Visit& visit);

  const Material& material_;
  const Sheet& sheet_;
  PotentialSolver potential_;
  PotentialProblem problem_;
  CellIndex corner_ = kNowhere;
  SurfaceMetric metric_;               ///< Under the tip; one for the whole window.
  std::array<float, 64> far_field_{};  ///< K1/(lambda K0) over distance [1/m].
  SourceStats stats_;
  bool keep_leak_ = false;
  alignas(64) std::array<float, kWindowCells> leak_V2s_{};

  alignas(64) std::array<float, kWindowCells> enthalpy_{}, water_{}, inverse_volume_{};
  alignas(64) std::array<float, kWindowCells> tissue_{};  ///< sigma wet at body temperature [S/m]; 0: no tissue.
  alignas(64) std::array<std::uint8_t, kWindowCells> flags_{};
};

}  // namespace fulcrum::thermal
