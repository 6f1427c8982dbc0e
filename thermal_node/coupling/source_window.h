// Current and Joule heat around the tip: a 64 x 64 copy of the cells, advanced from event to event.
//
// A potential is valid until the tissue changes. So each solve is followed by the longest step over which the change of
// the tissue's electrical conductivity changes the potential, and with it the heat, by at most `max_change` (see
// Change()). The tip's position is that at mid-step. With a fixed step of one frame the error is about the whole energy
// (lab notes).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "services/base/core/footprint.h"
#include "thermal_node/coupling/electrode.h"
#include "thermal_node/coupling/film.h"
#include "thermal_node/coupling/generator.h"
#include "thermal_node/heat/heat_field.h"
#include "thermal_node/potential/potential_solver.h"

namespace fulcrum::thermal {

/// Longest motion of the tip in a coupling step [cells]: 5 mm/s in half a frame.
inline constexpr float kMaxTravel = 0.26f;
/// Limit of the number of coupling steps that the tip's motion requires in a run: half a radius each at 50 mm/s, and no
/// more for a jump.
inline constexpr float kMaxStepsByTravel = 4.0f;
/// Largest distance of metal from the window's middle [cells]; metal beyond is left out and the frame counted. The
/// remaining six cells to the window's border are for the tip's motion and the sparks.
inline constexpr float kMetalReach = 26.0f;
inline constexpr float kFarGap = 1e6f;  ///< Gap of a cell without metal near it [cells].
/// Corner of a window that has not been used yet: far from any sheet, yet no overflow in differences.
inline constexpr CellIndex kNowhere{-(1 << 24), -(1 << 24)};
/// Radius around the tip beyond which a tented sheet lies on tissue and is at 0 V [m]; assumed.
inline constexpr float kTentRadius_m = 0.015f;

/// The leaky sheet far from the electrode: the solution of V'' + V'/r = V g(r) / (sigma d) that falls to 0, g the leak.
/// Distances in metres.
class FarField {
 public:
  explicit FarField(const Material& material);
  /// -V' / V [1/m].
  [[nodiscard]] float SlopeAt(float r_m) const { return At(slope_, r_m); }
  /// Joule heat by volume, in any unit.
  [[nodiscard]] float DensityAt(float r_m) const { return At(density_, r_m); }
  /// Of the power that crosses a circle, the share that the sheet beyond it dissipates; the rest is the tissue's
  /// beneath.
  [[nodiscard]] float ShareAt(float r_m) const { return At(share_, r_m); }
  /// Distance from the metal's middle within which the heat beyond the window is put [m].
  [[nodiscard]] float reach_m() const { return reach_m_; }

 private:
  static constexpr std::size_t kCount = 64;
  static constexpr float kSpacing = 0.1f;  ///< Of the tables, in window widths.
  using Table = std::array<float, kCount>;
  [[nodiscard]] float At(const Table& table, float r_m) const;

  float spacing_, reach_m_ = 0;
  Table slope_{}, density_{}, share_{};
};

/// Motion of the metal over a span of time, in material space: from one footprint to the next. Without footprints the
/// metal is a capsule about the contact's centre with its axis in the sheet.
struct TipPath {
  Vec2f from = Vec2f::Zero(), to = Vec2f::Zero();  ///< Start and end of the contact's centre [m].
  Footprint begin, end;
  float part_from = 0, part_to = 1;    ///< Fractions of the motion from `begin` to `end` between which this path lies.
  Vec2f displacement = Vec2f::Zero();  ///< Motion of the centre from `begin` to `end`, over all parts [m].
  Vec2f half = Vec2f::Zero();          ///< Capsule: vector from the centre to one end of its axis [m].
  float radius_m = 0;                  ///< Capsule: radius of the metal around its axis.
  bool tented = false;
};

/// The part of a path between its fractions a and b.
[[nodiscard]] TipPath PartOf(const TipPath& path, float a, float b);

/// Accumulated over Run() calls until ClearStats().
struct SourceStats {
  int solves = 0, iterations = 0;  ///< One solve per coupling step.
  int by_change = 0;               ///< Coupling steps limited by max_change.
  int by_travel = 0;               ///< Coupling steps limited by kMaxTravel or kFilmStep_s.
  int by_floor = 0;  ///< Coupling steps of min_step_s, where a limit was shorter. All other steps end with the run.
  bool shortened = false;  ///< The metal did not fit into the window.
  int removed_cells = 0;
  CellIndex low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};  ///< Box of the removed cells.
  float voltage_V = 0, current_A = 0;                               ///< Electrode, rms, of the last solve.
  /// Heat of the tissue beneath the window (after KeepLeak) and beneath the sheet beyond, where it is put nowhere [J].
  double leak_J = 0, far_leak_J = 0;
  float imbalance = 0;  ///< Largest PotentialResult::imbalance.
};

class SourceWindow {
 public:
  /// Both must outlive it. The material is that of the sheet beneath the contact; cells of others count as missing.
  SourceWindow(std::span<const Material> materials, const Sheet& sheet);
  SourceWindow(const Material& material, const Sheet& sheet) : SourceWindow(std::span(&material, 1), sheet) {}

  /// Heats the sheet for `duration_s` while the tip moves along the path.
  void Run(HeatField* field, const TipPath& path, const Drive& drive, float duration_s, Ledger* ledger);

  /// Heats the sheet beyond the window by what the current of the last Runs has dissipated there. `hold`: its tiles
  /// stay awake in the next Diffuse, although one frame may warm them by less than kSleepTheta.
  void DepositFar(HeatField* field, bool hold, Ledger* ledger);

  /// Time integral of the squared potential against the tissue beneath, over the last Run [V^2 s]; cell (i, j) of the
  /// window at j * kWindow + i, cell (0, 0) at corner(). 0 where nothing leaks: holes, a tented sheet. Computed only
  /// after KeepLeak().
  [[nodiscard]] const std::array<float, kWindowCells>& leak_V2s() const { return leak_V2s_; }
  [[nodiscard]] CellIndex corner() const { return corner_; }
  void KeepLeak() { keep_leak_ = true; }

  [[nodiscard]] const SourceStats& stats() const { return stats_; }
  void ClearStats() { stats_ = {}; }

  /// Limit of Change() over a coupling step. At 0.1 a step ends when a cell that takes one hundredth of the heat dries.
  /// Error in the benchmark: thermal.coupling_error_pct.
  float max_change = 0.1f;
  /// Shortest coupling step [s]: bounds their number; seldom reached.
  float min_step_s = 2.5e-4f;
  float tolerance = kWorkingTolerance;  ///< Relative error of the potential in the energy norm.

  [[nodiscard]] const Interface& interface() const { return interface_; }
  /// The state of the metal after it has touched tissue of another window.
  void SetInterface(const Interface& interface) { interface_ = interface; }
  /// Cools the metal, which loses heat to its shaft and the air.
  void CoolHook(float dt_s) { interface_.Cool(dt_s); }

  /// For checkpoints: the window's place, the last coupling step and the start value of the next solve.
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
  void SelectMaterial(int number);
  /// The tile around a cell, awake; nullptr: it is none of the window's material.
  [[nodiscard]] Tile* TileAt(HeatField* field, int ix, int iy) const;
  void RefreshTiles(HeatField* field, Ledger* ledger);
  void Load(HeatField* field, Ledger* ledger);
  /// Copies the window back to the tiles. All tiles under the window are marked as the tip's place is: tented or not.
  void Store(HeatField* field, bool tented);
  void SetLeak(const Vec2f& middle, bool tented);
  void SetGround(const Vec2f& middle, bool tented);
  void GroundEnds(const Band& band);
  /// Sets the gap of each cell from the metal at fraction `at` of the path.
  void SetGaps(const TipPath& path, float at, float reach_m);
  void AddCapsule(const TipPath& path, float at, float reach);
  void AddFootprint(const TipPath& path, float at, float reach);
  void AddGap(int i, int j, float gap);
  void SetContact(const Drive& drive);
  /// Fraction of the footprint that boils.
  [[nodiscard]] float Boiling() const;
  /// Exchanges heat between the metal and the tissue that it touches.
  void ExchangeWithHook(float dt_s, Ledger* ledger);
  void SetSigma();
  [[nodiscard]] float FilmDrop() const;
  void LeaveOutFilm();
  /// Relative change of the potential, in the energy norm, over a step with `v2_s` [V^2 s] of the last solve's heat. If
  /// the conductivity of a round inclusion changes from s to s', the field around it changes by sqrt(2) b of what the
  /// inclusion dissipated, b = |s' - s| / (s' + s) (dipole in two dimensions). Each cell is treated as such an
  /// inclusion without interaction: the result is the root of the mean of b^2, weighted by heat. Warming and drying are
  /// added with equal sign, because they would cancel.
  [[nodiscard]] float Change(float v2_s, float heat_S) const;
  /// Longest step with Change() up to max_change, at most `longest` [s].
  [[nodiscard]] float StepByChange(float v2, float heat_S, float longest) const;
  [[nodiscard]] float SolveStep(const Drive& drive, float longest);
  void Heat(const Drive& drive, bool tented, float dt_s, Ledger* ledger);
  void Deposit(float v2_s, float remove_theta, Ledger* ledger);
  /// Radius of the disc that is as large as the metal's footprint [cells].
  [[nodiscard]] float MetalRadius() const;
  void AddLeak(float v2_s);
  void AddFar(float v2_s);
  void BoilRow(int j, float remove_theta, Ledger* ledger);
  void RemoveDry(int j, float too_hot, Ledger* ledger);
  template <class Visit>
  void ForTileRows(HeatField* field, const Visit& visit);

  std::span<const Material> materials_;
  const Sheet& sheet_;
  const Material* material_;  ///< Of the last Run.
  int number_ = 0;            ///< Of that material.
  PotentialSolver potential_;
  PotentialProblem problem_;
  CellIndex corner_ = kNowhere;
  float step_s_ = 0;           ///< Last coupling step [s], the estimate for the length of the next one.
  SurfaceMetric metric_;       ///< Metric under the tip, used for the whole window.
  std::vector<FarField> far_;  ///< By material.
  /// Conductance of each face of the window's border to the far field: four times a side.
  struct BorderFace {
    std::uint8_t i = 0, j = 0;
    float sheet_S = 0, leak_S = 0;  ///< The parts whose power heats the sheet and the tissue beneath.
  };
  std::array<BorderFace, 4 * kWindow> border_{};
  double far_J_ = 0;  ///< Heat of the sheet beyond the window since the last DepositFar [J].
  Vec2f far_middle_ = Vec2f::Zero();
  bool far_tented_ = false;
  SourceStats stats_;
  bool keep_leak_ = false;
  alignas(64) std::array<float, kWindowCells> leak_{};  ///< Conductance to the tissue beneath [S].
  alignas(64) std::array<float, kWindowCells> leak_V2s_{};

  /// Heat of the last solve without that of the film [W/V^2].
  alignas(64) std::array<float, kWindowCells> dissipated_{};
  alignas(64) std::array<float, kWindowCells> enthalpy_{}, water_{}, inverse_volume_{};
  alignas(64) std::array<float, kWindowCells> tissue_{};  ///< Electrical conductivity, wet at body temperature [S/m];
                                                          ///< 0: no tissue.
  alignas(64) std::array<std::uint8_t, kWindowCells> flags_{};
  /// Distance of each cell from the metal's surface [cells]; kFarGap without metal near it. Set within [gap_low_,
  /// gap_high_].
  alignas(64) std::array<float, kWindowCells> gap_{};
  CellIndex gap_low_{kWindow, kWindow}, gap_high_{-1, -1};
  Interface interface_;
  PotentialResult solved_;
};

}  // namespace fulcrum::thermal
