#include "tests/numerics/thermal/potential_rings.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

namespace fulcrum::thermal {
namespace {

/// Dirichlet value through a conductance far above any face's.
constexpr float kStiff = 1e3f;

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

}  // namespace

RingsResult SolveRings(double inner, double outer, float tolerance) {
  const float sigma = 0.35f, thickness = 3e-4f;
  auto problem = std::make_unique<PotentialProblem>();
  problem->face_s = problem->face_t = thickness;
  problem->sigma.fill(sigma);
  // The circles cut the faces between cell centres. A conductance in series with a stiff cell would put the circle at
  // the centre of the last cell inside; so the cells next to a circle are tied to it by the part of the face's length
  // that lies between them and the circle.
  const double middle = kWindow / 2.0 + 0.137;  // not symmetric to the grid
  const auto radius = [&](int i, int j) { return std::hypot(i + 0.5 - middle, j + 0.5 - middle); };
  const auto tie = [&](int i, int j, int di, int dj, double circle, float* out) {
    // Distance in cells from the centre of (i, j) towards (di, dj) to the circle, by bisection.
    double low = 0, high = 1;
    const double side = radius(i, j) - circle;
    for (int n = 0; n < 40; ++n) {
      const double s = 0.5 * (low + high);
      const double here = std::hypot(i + 0.5 + s * di - middle, j + 0.5 + s * dj - middle) - circle;
      (here * side > 0 ? low : high) = s;
    }
    *out += static_cast<float>(sigma * thickness / std::max(high, 1e-3));
  };
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) {
      const int k = j * kWindow + i;
      const double r = radius(i, j);
      if (r <= inner || r >= outer) {
        problem->sigma[k] = 0;
        continue;
      }
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (radius(i + di, j + dj) <= inner) tie(i, j, di, dj, inner, &problem->contact[k]);
        if (radius(i + di, j + dj) >= outer) tie(i, j, di, dj, outer, &problem->ground[k]);
      }
    }
  }
  const auto time = [](const auto& body) {
    const auto start = std::chrono::steady_clock::now();
    body();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  };
  auto solver = std::make_unique<PotentialSolver>();
  PotentialResult solved;
  RingsResult result;
  std::vector<double> cold, warm;
  for (int n = 0; n < 15; ++n) {
    solver->ImportStart({});
    cold.push_back(time([&] { solved = solver->Solve(*problem, tolerance); }));
    result.iterations_cold = solved.iterations;
    // A step of cutting: the contact changes by a few per cent.
    auto next = std::make_unique<PotentialProblem>(*problem);
    for (int k = 0; k < kWindowCells; ++k) next->contact[k] *= k % kWindow > kWindow / 2 ? 1.05f : 0.95f;
    warm.push_back(time([&] { result.iterations_warm = solver->Solve(*next, tolerance).iterations; }));
  }
  solver->ImportStart({});
  solved = solver->Solve(*problem, tolerance);
  result.solve_ms_cold = Median(cold);
  result.solve_ms_warm = Median(warm);
  const double exact = 2 * std::numbers::pi * sigma * thickness / std::log(outer / inner);
  result.current_error = std::abs(solved.conductance_S - exact) / exact;
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) {
      const double r = radius(i, j);
      if (r < inner + 4 || r > outer - 4) continue;
      // q = sigma d |grad V|^2 per cell area, |grad V| = 1 / (r ln(b/a)).
      const double q = sigma * thickness / std::pow(r * std::log(outer / inner), 2);
      result.heat_error = std::max(result.heat_error, std::abs(solver->heat()[j * kWindow + i] - q) / q);
    }
  }
  return result;
}

}  // namespace fulcrum::thermal
