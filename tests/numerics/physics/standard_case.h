// The case on which all solvers are compared: a patch in the middle of the membrane is pulled up, held and released.
//
//      lift            ______________
//                     /              |          frames of 10 ms; linear in time, so that the start
//                    /               |          and the stop of the pull send waves
//      0  __________/                |_ _ _ _ (free)
//         0       0.5 s          0.8 s    1 s
//
// The case begins in equilibrium (with the model's dead load that is the scene's rest shape, to the rounding of the
// scene's floats); displacements are relative to it. The reference solves the dynamics by central differences
// (explicit_dynamics.h) and the equilibria by Newton's method (static_solver.h); both are computed once per scene and
// stored in a file.
#pragma once

#include <filesystem>
#include <vector>

#include "services/scene/format/scene_file.h"
#include "tests/numerics/physics/reference/elastic_energy.h"
#include "tests/numerics/physics/solver_under_test.h"

namespace fulcrum::physics {

struct StandardCaseSettings {
  int patch_rows = 15, patch_cols = 5;  ///< 75 particles.
  double lift_m = 0.030;
  int slit_rows = 150, slit_offset_cols = 6;  ///< The cut: 2 edges a row, this many columns from the middle.
  MembraneModel membrane = MembraneModel::kContinuum;
};
inline constexpr StandardCaseSettings kBuiltInCase{};
class StandardCase {
 public:
  static constexpr double kFrame_s = 0.01;
  static constexpr int kPullFrames = 50, kHoldFrames = 80, kFrames = 100;
  static constexpr int kCutFrame = 25, kCutSettled = 40;
  static constexpr int kSampleFrames = 5;  ///< Positions are compared at every fifth frame.

  /// `data` is changed to the case's parameters: E t 300 N/m, prestrain 4 %, damping 20 /s, E 100 kPa, nu 0.45, gravity
  /// 0, no stiffening, steps of 10 ms.
  StandardCase(scene::SceneData data, const StandardCaseSettings& settings);

  [[nodiscard]] const SceneView& scene() const { return view_; }
  [[nodiscard]] const ElasticModel& model() const { return model_; }
  [[nodiscard]] const std::vector<Index>& held() const { return held_; }
  [[nodiscard]] const std::vector<std::size_t>& cut_edges() const { return cut_edges_; }
  [[nodiscard]] double lift_m() const { return settings_.lift_m; }
  /// Height of the patch at the end of frame `frame` [m].
  [[nodiscard]] double Lift(double frame) const { return settings_.lift_m * std::min(1.0, frame / kPullFrames); }

  struct Reference {
    reference::Points equilibrium;  ///< Initial state.
    reference::Points hold;         ///< Equilibrium with the patch up.
    Vec3d force_N = Vec3d::Zero();  ///< Force on the patch in `hold`.
    double equilibrium_residual_N = 0, hold_residual_N = 0;
    double step_s = 0;                      ///< Time step of the dynamics.
    std::vector<reference::Points> frames;  ///< After each kSampleFrames, up to kFrames.
    std::vector<reference::Points>
        cut_frames;  ///< The same with the edges cut at kCutFrame, from there to kPullFrames.
  };
  /// Computes the reference with `steps_per_frame` steps a frame (0: the least number that is stable with a margin).
  [[nodiscard]] Reference ComputeReference(int steps_per_frame = 0) const;
  /// Reads the reference from `folder` if it was computed before for the same model and case, else computes and writes
  /// it.
  [[nodiscard]] Reference LoadReference(const std::filesystem::path& folder) const;

 private:
  [[nodiscard]] std::uint64_t Hash() const;

  StandardCaseSettings settings_;
  scene::SceneData data_;
  SceneView view_;
  ElasticModel model_;
  std::vector<Index> held_;
  std::vector<std::size_t> cut_edges_;
};

/// Errors are RMS over the particles and frames, over the RMS displacement from the equilibrium in the truth. After the
/// release that displacement goes to 0, so the one in the hold is used instead. The sheet springs back into folds as
/// fine as its mesh, which are chaotic: halving the step of the reference changes `release` by the figure that the
/// benchmark gives as its floor. The same is true for a while after the cut, so `cut` is measured at the end of the
/// pull.
struct StandardErrors {
  double pull = 0;        ///< Frames of the pull.
  double release = 0;     ///< Frames after the release.
  double hold = 0;        ///< Last frame of the hold against the equilibrium.
  double hold_max_m = 0;  ///< Largest distance of a particle in that frame.
  double force = 0;       ///< |force on the patch - that of the equilibrium| over its size.
  double volume = 0;      ///< |volume of the organ - that of the equilibrium| over that of the equilibrium.
  double tet_volume = 0;  ///< RMS over the tets of the difference of their volumes, over their volume at rest.
  double strain = 0;      ///< RMS difference of the strain of the membrane's edges, absolute.
  double cut = 0;         ///< Frames kCutSettled to kPullFrames in the run with the cut.
};

struct StandardRun {
  StandardErrors errors;
  std::vector<double> frame_ms;  ///< Frames of the run without the cut.
  std::vector<double>
      cut_frame_ms;  ///< Frames of the run with it: the frame of the cut, cutting included, and those after.
};

/// Runs the case (without and, `with_cut`, once more with the cut) and measures it. `scene` is that of the case, or a
/// copy with other settings of the solver.
[[nodiscard]] StandardRun RunStandardCase(const StandardCase& standard, const StandardCase::Reference& truth,
                                          const SolverFactory& make, const SceneView& scene, bool with_cut);

}  // namespace fulcrum::physics
