// Electric potential of the sheet in a 64 x 64 window around the electrode.
//
//   div(sigma d grad V) - ground V + contact (1 - V) = 0        (leaky sheet, electrode at 1 V)
//
// V is linear in the electrode's voltage, so one solve at 1 V serves every power. Conjugate gradients with one V-cycle
// of cell-centred multigrid as preconditioner, started from the last solution.
#pragma once

#include <array>
#include <memory>

namespace fulcrum::thermal {

inline constexpr int kWindow = 64;  ///< Cells along the window's edge.
inline constexpr int kWindowCells = kWindow * kWindow;

/// Input, cell (i, j) at j * kWindow + i.
struct PotentialProblem {
  alignas(64) std::array<float, kWindowCells> sigma{};    ///< Electrical conductivity [S/m]; 0: no tissue.
  alignas(64) std::array<float, kWindowCells> contact{};  ///< Conductance to the electrode [S].
  alignas(64) std::array<float, kWindowCells> lost{};    ///< Share of `contact` whose heat does not enter the cell [S].
  alignas(64) std::array<float, kWindowCells> ground{};  ///< Conductance to the return electrode [S].
  float face_s = 0;  ///< d * lt / ls: conductance of a face across s is this times the harmonic sigma [m].
  float face_t = 0;
};

struct PotentialResult {
  float conductance_S = 0;  ///< Electrode current at 1 V.
  double heat_S = 0;        ///< Joule heat in the window at 1 V [W/V^2].
  double lost_S = 0;        ///< Power in the `lost` part of the contact at 1 V [W/V^2].
  double scale = 1;         ///< Factor of the rescaling of all powers.
  float imbalance = 0;      ///< |power in - heat - lost - power into ground| / power in, before the rescaling.
  int iterations = 0;
};

/// Relative error of the potential in its energy norm during cutting. A coupling step lets the tissue change the
/// potential by five times as much; with 1e-4 instead the energy of a cut changes by less than 0.1 %.
inline constexpr float kWorkingTolerance = 2e-2f;
inline constexpr float kImbalanceLimit = 0.02f;  ///< Energy guard: the iteration continues above this imbalance.

class PotentialSolver {
 public:
  PotentialSolver();
  ~PotentialSolver();

  /// Iterates until the error in the energy norm, relative to the solution, is `tolerance`. While the energy guard is
  /// not met, the tolerance is divided by ten and the iteration continues, at most twice. The heat is rescaled so that
  /// power in equals heat plus lost power plus power into ground.
  PotentialResult Solve(const PotentialProblem& problem, float tolerance);

  /// Joule heat per cell at 1 V [W/V^2] of the last solve; the heat of a face is shared between its two cells in
  /// proportion to their resistances.
  [[nodiscard]] const std::array<float, kWindowCells>& heat() const { return heat_; }
  /// The same summed over each row.
  [[nodiscard]] const std::array<float, kWindow>& row_heat() const { return row_heat_; }
  /// Potential at 1 V of the last solve.
  [[nodiscard]] float Voltage(int i, int j) const;

  /// Moves the start value of the next solve with the window by whole cells.
  void Shift(int di, int dj);
  /// Start value without halo, for checkpoints.
  void ExportStart(std::array<float, kWindowCells>* start) const;
  void ImportStart(const std::array<float, kWindowCells>& start);

 private:
  struct Multigrid;
  [[nodiscard]] int Iterate(float tolerance);
  [[nodiscard]] PotentialResult Evaluate(const PotentialProblem& problem);

  std::unique_ptr<Multigrid> grid_;
  alignas(64) std::array<float, kWindowCells> heat_{};
  std::array<float, kWindow> row_heat_{};
};

}  // namespace fulcrum::thermal
