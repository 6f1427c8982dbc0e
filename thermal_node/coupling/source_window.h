// Current and Joule heat around the tip: a 64 x 64 copy of the cells, advanced from event to event.
//
// A potential is valid until the tissue changes. So after each solve the step is as long as the change of the tissue's
// conductivity over it keeps the potential, and with it the heat, within `max_change` (see Change()); the tip is taken
// at mid-step. A fixed step of a frame would be wrong by about the whole energy (lab notes).
#pragma once

#include <array>
#include <cstdint>

#include "services/base/core/footprint.h"
#include "thermal_node/coupling/electrode.h"
#include "thermal_node/coupling/film.h"
#include "thermal_node/coupling/generator.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/potential/potential_solver.h"

namespace fulcrum::thermal {

inline constexpr float kMaxWay = 0.26f;  ///< Of the tip in a coupling step [cells]: 5 mm/s in half a frame.
/// Coupling steps of a run for the tip's way at most: half a radius each at 50 mm/s, and no more at a jump.
inline constexpr float kMostByWay = 4.0f;
/// From the window's middle to the end of the metal [cells]: what lies beyond is left out, and counted. The other six
/// cells to the window's border are for the tip's way and the sparks.
inline constexpr float kMetalReach = 26.0f;
inline constexpr float kFarGap = 1e6f;  ///< No metal near [cells].
/// Corner of a window that has not been used yet: far from any sheet, yet no overflow in differences.
inline constexpr CellIndex kNowhere{-(1 << 24), -(1 << 24)};
inline constexpr float kTentRadius_m = 0.015f;  ///< A tented sheet returns its current to the tissue from here on.

/// What the metal does over a span of time, in material space: it goes from one footprint to the next. Without
/// footprints it is a capsule about the contact's centre, its axis in the sheet.
struct TipPath {
  Vec2f from = Vec2f::Zero(), to = Vec2f::Zero();  ///< Of the contact's centre [m].
  Footprint begin, end;
  float part_from = 0, part_to = 1;  ///< The part of the way from `begin` to `end` that this path is.
  Vec2f way = Vec2f::Zero();         ///< Of the centre from `begin` to `end`, over all parts [m].
  Vec2f half = Vec2f::Zero();        ///< Of the capsule: from the centre to either end of its axis [m].
  float radius_m = 0;                ///< Of the metal around its axis.
  bool tented = false;
};

/// Of a path, from part a to part b of it.
[[nodiscard]] TipPath PartOf(const TipPath& path, float a, float b);

/// Accumulated over Run() calls until ClearStats().
struct SourceStats {
  int solves = 0, iterations = 0;  ///< A solve per coupling step.
  int by_change = 0;               ///< Coupling steps that ended where the tissue had changed by max_change.
  int by_way = 0;                  ///< Where the tip had gone kMaxWay.
  int by_floor = 0;                ///< At min_step_s, where one of these asked for less. The rest ended with the run.
  bool shortened = false;          ///< The metal did not fit into the window.
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

  /// Change() over a coupling step. At 0.1 a cell that gets one hundredth of the heat and dries ends it. See
  /// thermal.coupling_error_pct.
  float max_change = 0.1f;
  /// Shortest coupling step [s]: a guard against endless ones, seldom reached.
  float min_step_s = 2.5e-4f;
  float tolerance = kWorkingTolerance;  ///< Of the potential.

  [[nodiscard]] const Interface& interface() const { return interface_; }
  /// The metal cools on its shaft and in the air.
  void CoolHook(float dt_s) { interface_.Cool(dt_s); }

  /// For checkpoints: where the window stood, the last coupling step and the start value of the next solve.
  struct State {
    CellIndex corner = kNowhere;
    float step_s = 0;
    Interface interface;
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
  /// Gap of each cell from the metal at part `at` of the path.
  void SetGaps(const TipPath& path, float at, float reach_m);
  void AddCapsule(const TipPath& path, float at, float reach);
  void AddFootprint(const TipPath& path, float at, float reach);
  void AddGap(int i, int j, float gap);
  void SetContact(const Drive& drive);
  /// Part of the footprint that boils.
  [[nodiscard]] float Boiling() const;
  /// Heat between metal and what it touches, for a time.
  void ExchangeWithHook(float dt_s, Ledger* ledger);
  void SetSigma();
  [[nodiscard]] float FilmDrop() const;
  void LeaveOutFilm();
  /// How far the potential goes wrong while the tissue takes `v2_s` [V^2 s] with the heat of the last solve. A round
  /// inclusion whose conductivity goes from s to s' changes a field about it, in the energy norm, by sqrt(2) b of what
  /// it dissipated, b = |s' - s| / (s' + s) (dipole in two dimensions); cells are taken as such inclusions, each for
  /// itself: the root of the mean of b^2, weighted by heat. Warming and drying count apart, because they would cancel.
  [[nodiscard]] float Change(float v2_s, float heat_S) const;
  /// The longest step, at most `longest`, with no more than max_change [s].
  [[nodiscard]] float StepByChange(float v2, float heat_S, float longest) const;
  [[nodiscard]] float SolveStep(const Drive& drive, float longest);
  void Heat(const Drive& drive, bool tented, float dt_s, Ledger* ledger);
  void Deposit(float v2_s, float remove_theta, Ledger* ledger);
  void AddLeak(float v2_s);
  void BoilRow(int j, float remove_theta, Ledger* ledger);
  void RemoveDry(int j, float too_hot, Ledger* ledger);
  template <class Visit>
  void ForTileRows(HeatField* field, const Visit& visit);

  const Material& material_;
  const Sheet& sheet_;
  PotentialSolver potential_;
  PotentialProblem problem_;
  CellIndex corner_ = kNowhere;
  float step_s_ = 0;                   ///< The last coupling step: the next one is expected to be as long.
  SurfaceMetric metric_;               ///< Under the tip; one for the whole window.
  std::array<float, 64> far_field_{};  ///< K1/(lambda K0) over distance [1/m].
  SourceStats stats_;
  bool keep_leak_ = false;
  alignas(64) std::array<float, kWindowCells> leak_V2s_{};

  alignas(64) std::array<float, kWindowCells> dissipated_{};  ///< Of the last solve, in tissue alone [W/V^2].
  alignas(64) std::array<float, kWindowCells> enthalpy_{}, water_{}, inverse_volume_{};
  alignas(64) std::array<float, kWindowCells> tissue_{};  ///< sigma wet at body temperature [S/m]; 0: no tissue.
  alignas(64) std::array<std::uint8_t, kWindowCells> flags_{};
  /// From the metal's surface [cells]; kFarGap where nothing of it is near. Set within [gap_low_, gap_high_].
  alignas(64) std::array<float, kWindowCells> gap_{};
  CellIndex gap_low_{kWindow, kWindow}, gap_high_{-1, -1};
  Interface interface_;
  PotentialResult solved_;
};

}  // namespace fulcrum::thermal
