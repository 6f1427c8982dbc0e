#include "tests/benchmark/thermal/work_precision.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/benchmark/thermal/baselines/grid_steppers.h"
#include "tests/benchmark/work_precision_plot.h"
#include "tests/numerics/thermal/moving_gaussian.h"
#include "thermal_node/paper/paper_model.h"

namespace fulcrum::thermal {
namespace {

using benchmark::WorkPrecisionPoint;

struct Figures {
  double ms = 0, error = 0;
  int tiles = 0;  ///< Tiles awake; 0: one whole grid.
};

/// The exact temperatures at the end, at the cell centres of a grid over the window; cached for the next method.
const std::vector<float>& Exact(const MovingGaussian& problem, int n) {
  static std::map<int, std::vector<float>> kept;
  std::vector<float>& field = kept[n];
  const double h = MovingGaussian::kWindow / n;
  for (int k = static_cast<int>(field.size()); k < n * n; ++k) {
    const double x = (k % n + 0.5) * h, y = (k / n + 0.5) * h;
    field.push_back(static_cast<float>(problem.Exact(x, y, problem.frames() * MovingGaussian::kDt)));
  }
  return field;
}

/// Heating of one frame [K]: with the tip at its position at the start of the frame, or swept, by three Gauss points in
/// time.
void Heat(const MovingGaussian& problem, int frame, bool swept, int n, double cell_m, std::vector<float>* heating) {
  constexpr double kNode = 0.7745966692414834, kDt = MovingGaussian::kDt;
  const double start = frame * kDt, middle = start + 0.5 * kDt;
  for (int k = 0; k < n * n; ++k) {
    const double x = (k % n + 0.5) * cell_m, y = (k / n + 0.5) * cell_m;
    const double rate = swept ? (5 * problem.Rate(x, y, middle - 0.5 * kDt * kNode) + 8 * problem.Rate(x, y, middle) +
                                 5 * problem.Rate(x, y, middle + 0.5 * kDt * kNode)) /
                                    18
                              : problem.Rate(x, y, start);
    (*heating)[k] = static_cast<float>(rate * kDt);
  }
}

/// Runs a stepper on a grid of `texels` squared that begins at the window's corner; only the window is compared.
Figures Run(const std::function<std::unique_ptr<GridStepper>(const UniformGrid&)>& make, int window_cells, int texels,
            double diffusivity_factor, bool swept) {
  const MovingGaussian problem;
  const double cell_m = MovingGaussian::kWindow / window_cells;
  const auto stepper = make({texels, cell_m, diffusivity_factor * problem.diffusivity_m2_s});
  std::vector<float> theta(static_cast<std::size_t>(texels) * texels), heating(theta);
  std::vector<double> times;
  for (int frame = 0; frame < problem.frames(); ++frame) {
    Heat(problem, frame, swept, texels, cell_m, &heating);
    const auto step = [&] { stepper->Step(&theta, heating, MovingGaussian::kDt); };
    times.push_back(benchmark::TimeMs(0, 1, step).front());
  }
  const std::vector<float>& exact = Exact(problem, window_cells);
  double worst = 0;
  for (int k = 0; k < window_cells * window_cells; ++k) {
    const float got = theta[k / window_cells * texels + k % window_cells];
    worst = std::max(worst, std::abs(static_cast<double>(got) - exact[k]));
  }
  return {benchmark::Quantile(times, 0.5), worst / *std::max_element(exact.begin(), exact.end())};
}

struct Method {
  std::string key, family;
  std::function<Figures(int window_cells)> run;
  std::vector<int> cells_um = {50, 75, 100, 150, 200};
};

std::vector<Method> Methods() {
  const auto own = [](int n) {
    const MovingGaussianResult r = RunMovingGaussian(static_cast<float>(MovingGaussian::kWindow / n));
    return Figures{r.step_ms, r.max_error, r.tiles};
  };
  // The paper's method: the tip at the start of the frame, one step of the whole texture. Its diffusivity, read in
  // mm^2/s, is 4.5 times that of tissue.
  const auto paper = [](double factor) {
    return [factor](int n) { return Run(MakeForwardEuler, n, kTexture, factor, false); };
  };
  return {
      {"finite_volumes", "this project: finite volumes on the awake tiles, swept source split in halves", own},
      {"ftcs", "forward Euler (FTCS), tip at the frame's start",
       [](int n) { return Run(MakeForwardEuler, n, n, 1, false); }},
      {"adi", "ADI (Peaceman-Rachford), swept source",
       [](int n) { return Run(MakeAlternatingDirections, n, n, 1, true); }},
      {"crank_nicolson", "Crank-Nicolson by conjugate gradients, swept source",
       [](int n) { return Run(MakeCrankNicolson, n, n, 1, true); }},
      {"paper", "the paper: whole texture of 256², tip at the frame's start", paper(1), {100}},
      {"paper_diffusivity",
       "the same with the paper's diffusivity, 4.5 times that of tissue",
       paper(kPaperDiffusivity_m2_s / MovingGaussian{}.diffusivity_m2_s),
       {100}},
  };
}

}  // namespace

void WorkPrecision(benchmark::Report* report) {
  std::vector<WorkPrecisionPoint> points;
  bool all = true;
  for (const Method& method : Methods()) {
    const std::string stem = "thermal.work_precision." + method.key + ".";
    if (!report->Wants(stem)) {
      all = false;
      continue;
    }
    for (const int um : method.cells_um) {
      const int cells = static_cast<int>(std::lround(1e6 * MovingGaussian::kWindow / um));
      const Figures figures = method.run(cells);
      const std::string size = std::to_string(um);
      report->Add(stem + size + "um.ms", figures.ms, "ms");
      report->Add(stem + size + "um.error_pct", 100 * figures.error, "%");
      if (figures.tiles > 0) report->Add(stem + size + "um.tiles", figures.tiles, "1");
      points.push_back({size + " µm", method.family, figures.ms, {100 * figures.error}});
    }
  }
  if (!all) return;  // A plot of some methods could be mistaken for the complete one.
  const char* folder = std::getenv("FULCRUM_BENCH_OUT");
  const std::filesystem::path file =
      std::filesystem::path(folder != nullptr ? folder : FULCRUM_SOURCE_DIR "/out") / "thermal_work_precision.svg";
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << benchmark::WorkPrecisionSvg("Conduction: error against run time, one core",
                                                     {"moving Gaussian, 10 mm/s, 0.25 mm: largest error over peak"},
                                                     points, true);
  std::fprintf(stderr, "wrote %s\n", file.c_str());
}

}  // namespace fulcrum::thermal
