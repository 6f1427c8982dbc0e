#include "thermal_node/potential/potential_solver.h"

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "thermal_node/potential/multigrid.h"

namespace fulcrum::thermal {
namespace {

constexpr int kMaxIterations = 60;

using Field = Eigen::Map<Eigen::ArrayXf>;
using ConstField = Eigen::Map<const Eigen::ArrayXf>;

float Dot(const std::vector<float>& a, const std::vector<float>& b) {
  const auto size = static_cast<Eigen::Index>(a.size());
  return (ConstField(a.data(), size) * ConstField(b.data(), size)).sum();
}

}  // namespace

struct PotentialSolver::Multigrid {
  Multigrid() {
    for (int n = kWindow; n >= 2; n /= 2) levels.emplace_back(n);
    const std::size_t count = levels[0].count;
    for (auto* field : {&v, &p, &ap, &residual, &contact, &sigma}) field->assign(count, 0.0f);
  }
  std::vector<Level> levels;
  std::vector<float> v;  ///< Solution, and start of the next solve.
  std::vector<float> p, ap, residual, contact, sigma;
};

PotentialSolver::PotentialSolver() : grid_(std::make_unique<Multigrid>()) {}
PotentialSolver::~PotentialSolver() = default;

float PotentialSolver::Voltage(int i, int j) const { return grid_->v[grid_->levels[0].At(i, j)]; }

PotentialResult PotentialSolver::Solve(const PotentialProblem& problem, float tolerance) {
  Level& fine = grid_->levels[0];
  for (int j = 0; j < kWindow; ++j) {
    const int o = fine.At(0, j);
    for (int i = 0; i < kWindow; ++i) {
      grid_->sigma[o + i] = problem.sigma[j * kWindow + i];
      grid_->contact[o + i] = problem.contact[j * kWindow + i];
      fine.mass[o + i] = problem.contact[j * kWindow + i] + problem.ground[j * kWindow + i];
    }
  }
  // The halo of sigma is 0, which closes the window's border; what flows on beyond it is in `ground`.
  constexpr float kTiny = std::numeric_limits<float>::min();
  for (int j = 0; j <= kWindow; ++j) {
    const int o = fine.At(0, j);
    const float* __restrict s = &grid_->sigma[o];
    float* __restrict fx = &fine.face_x[o];
    float* __restrict fy = &fine.face_y[o];
    const int up = fine.stride;
    for (int i = 0; i <= kWindow; ++i) {
      fx[i] = problem.face_s * 2.0f * s[i - 1] * s[i] / (s[i - 1] + s[i] + kTiny);
      fy[i] = problem.face_t * 2.0f * s[i - up] * s[i] / (s[i - up] + s[i] + kTiny);
    }
  }
  fine.Finish();
  for (std::size_t l = 1; l < grid_->levels.size(); ++l) Coarsen(grid_->levels[l - 1], &grid_->levels[l]);

  int iterations = Iterate(tolerance);
  PotentialResult result = Evaluate(problem);
  for (int more = 0; more < 2 && result.imbalance > kImbalanceLimit; ++more) {
    tolerance *= 0.1f;
    iterations += Iterate(tolerance);
    result = Evaluate(problem);
  }
  result.iterations = iterations;
  return result;
}

int PotentialSolver::Iterate(float tolerance) {
  Multigrid& g = *grid_;
  Level& fine = g.levels[0];
  const auto size = static_cast<Eigen::Index>(fine.count);
  Field v(g.v.data(), size), p(g.p.data(), size), ap(g.ap.data(), size), r(g.residual.data(), size);
  Field z(fine.x.data(), size), b(fine.b.data(), size);
  const float norm_b = std::sqrt(Dot(g.contact, g.contact));
  if (!(norm_b > 0.0f)) {
    v.setZero();
    return 0;
  }
  fine.Apply(g.v.data(), g.ap.data());
  r = ConstField(g.contact.data(), size) - ap;
  float rz = 0;
  for (int k = 0; k < kMaxIterations; ++k) {
    if (!(std::sqrt(Dot(g.residual, g.residual)) > tolerance * norm_b)) return k;
    b = r;
    VCycle(&g.levels, 0);
    const float rz_new = Dot(g.residual, fine.x);
    if (k == 0) {
      p = z;
    } else {
      p = z + (rz_new / rz) * p;
    }
    rz = rz_new;
    fine.Apply(g.p.data(), g.ap.data());
    const float alpha = rz / Dot(g.p, g.ap);
    v += alpha * p;
    r -= alpha * ap;
  }
  return kMaxIterations;
}

PotentialResult PotentialSolver::Evaluate(const PotentialProblem& problem) {
  Multigrid& g = *grid_;
  const Level& fine = g.levels[0];
  constexpr float kTiny = std::numeric_limits<float>::min();
  const int up = fine.stride;
  double in = 0, heat = 0, grounded = 0;
  for (int j = 0; j < kWindow; ++j) {
    const int o = fine.At(0, j);
    const float* __restrict v = &g.v[o];
    const float* __restrict s = &g.sigma[o];
    const float* __restrict fx = &fine.face_x[o];
    const float* __restrict fy = &fine.face_y[o];
    const float* __restrict contact = &problem.contact[j * kWindow];
    const float* __restrict ground = &problem.ground[j * kWindow];
    float* __restrict q = &heat_[j * kWindow];
    alignas(64) float row_in[kWindow], row_ground[kWindow];
    // Two half faces in series share the heat as their resistances: of a face, cell a gets sigma_b / (sigma_a +
    // sigma_b).
    const auto half = [&](float face, float dv, float mine, float other) {
      return face * dv * dv * other / (mine + other + kTiny);
    };
    for (int i = 0; i < kWindow; ++i) {
      const float drop = 1.0f - v[i];
      q[i] = half(fx[i], v[i] - v[i - 1], s[i], s[i - 1]) + half(fx[i + 1], v[i] - v[i + 1], s[i], s[i + 1]) +
             half(fy[i], v[i] - v[i - up], s[i], s[i - up]) + half(fy[i + up], v[i] - v[i + up], s[i], s[i + up]) +
             contact[i] * drop * drop;
      row_in[i] = contact[i] * drop;
      row_ground[i] = ground[i] * v[i] * v[i];
    }
    for (int i = 0; i < kWindow; ++i) {
      in += row_in[i];
      heat += q[i];
      grounded += row_ground[i];
    }
  }
  PotentialResult result;
  if (!(in > 0.0) || !std::isfinite(in + heat + grounded)) {
    // No contact; or the matrix held a bad number: start afresh and deliver nothing this time.
    heat_.fill(0);
    std::fill(g.v.begin(), g.v.end(), 0.0f);
    return result;
  }
  const double out = heat + grounded;
  result.conductance_S = static_cast<float>(in);
  result.imbalance = static_cast<float>(std::abs(in - out) / in);
  const auto scale = static_cast<float>(in / out);
  for (float& q : heat_) q *= scale;
  result.heat_S = static_cast<float>(heat) * scale;
  return result;
}

void PotentialSolver::ExportStart(std::array<float, kWindowCells>* start) const {
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) (*start)[j * kWindow + i] = Voltage(i, j);
  }
}

void PotentialSolver::ImportStart(const std::array<float, kWindowCells>& start) {
  std::fill(grid_->v.begin(), grid_->v.end(), 0.0f);
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) grid_->v[grid_->levels[0].At(i, j)] = start[j * kWindow + i];
  }
}

void PotentialSolver::Shift(int di, int dj) {
  if (di == 0 && dj == 0) return;
  std::array<float, kWindowCells> before, after{};
  ExportStart(&before);
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) {
      // Cells that come in at the border take the nearest known value.
      const int from_i = std::clamp(i + di, 0, kWindow - 1);
      const int from_j = std::clamp(j + dj, 0, kWindow - 1);
      after[j * kWindow + i] = before[from_j * kWindow + from_i];
    }
  }
  ImportStart(after);
}

}  // namespace fulcrum::thermal
