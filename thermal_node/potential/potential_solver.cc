#include "thermal_node/potential/potential_solver.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

#include "thermal_node/heat/wide.h"
#include "thermal_node/potential/multigrid.h"

namespace fulcrum::thermal {
namespace {

constexpr int kMaxIterations = 60;  ///< Bound of the run time.

/// Number of partial sums. Their order is fixed, so the result has the same bits on every CPU.
constexpr int kLanes = 32;
static_assert(kWindow % kLanes == 0);

using Field = Fine::Field;

FULCRUM_WIDE
float Dot(const Field& a, const Field& b) {
  alignas(64) float lane[kLanes] = {};
  const float* __restrict pa = a.data();
  const float* __restrict pb = b.data();
  const int count = static_cast<int>(a.size()) / kLanes * kLanes;
  for (int k = 0; k < count; k += kLanes) {
    for (int l = 0; l < kLanes; ++l) lane[l] += pa[k + l] * pb[k + l];
  }
  float sum = 0;
  for (const float part : lane) sum += part;
  for (int k = count; k < static_cast<int>(a.size()); ++k) sum += pa[k] * pb[k];
  return sum;
}

FULCRUM_WIDE
float Sum(const Field& a) {
  alignas(64) float lane[kLanes] = {};
  const float* __restrict pa = a.data();
  const int count = static_cast<int>(a.size()) / kLanes * kLanes;
  for (int k = 0; k < count; k += kLanes) {
    for (int l = 0; l < kLanes; ++l) lane[l] += pa[k + l];
  }
  float sum = 0;
  for (const float part : lane) sum += part;
  for (int k = count; k < static_cast<int>(a.size()); ++k) sum += pa[k];
  return sum;
}

/// y = x + f * y
FULCRUM_WIDE
void ScaleAdd(const Field& x, float f, Field* y) {
  const float* __restrict px = x.data();
  float* __restrict py = y->data();
  for (int k = 0; k < static_cast<int>(x.size()); ++k) py[k] = px[k] + f * py[k];
}

/// y += f * x
FULCRUM_WIDE
void Add(float f, const Field& x, Field* y) {
  const float* __restrict px = x.data();
  float* __restrict py = y->data();
  for (int k = 0; k < static_cast<int>(x.size()); ++k) py[k] += f * px[k];
}

FULCRUM_WIDE
void Scale(float f, std::span<float> x) {
  for (float& value : x) value *= f;
}

/// Face conductances of the finest level. The halo of sigma is 0, which closes the window's border; the current that
/// leaves the window is part of `ground`.
FULCRUM_WIDE
void SetFaces(const Field& sigma, float face_s, float face_t, Fine* fine) {
  constexpr int up = Fine::kStride;
  for (int j = 0; j <= kWindow; ++j) {
    const int o = Fine::At(0, j);
    const float* __restrict s = &sigma[o];
    float* __restrict fx = &fine->face_x[o];
    float* __restrict fy = &fine->face_y[o];
    for (int i = 0; i <= kWindow; ++i) {
      fx[i] = face_s * 2.0f * s[i - 1] * s[i] / (s[i - 1] + s[i] + kTiny);
      fy[i] = face_t * 2.0f * s[i - up] * s[i] / (s[i - up] + s[i] + kTiny);
    }
  }
}

/// Heat of one row of cells. Each cell is crossed by four half faces of resistance 1 / (2 sigma face), so a current I
/// leaves I^2 / (2 sigma face) in it.
FULCRUM_WIDE
void RowHeat(const Fine& fine, const Field& voltage, const Field& sigma, float face_s, float face_t, int j,
             const float* __restrict contact, const float* __restrict lost, float* __restrict q) {
  constexpr int up = Fine::kStride;
  const int o = Fine::At(0, j);
  const float* __restrict v = &voltage[o];
  const float* __restrict s = &sigma[o];
  const float* __restrict fx = &fine.face_x[o];
  const float* __restrict fy = &fine.face_y[o];
  const float half_s = 0.5f / face_s, half_t = 0.5f / face_t;
  for (int i = 0; i < kWindow; ++i) {
    const float left = fx[i] * (v[i] - v[i - 1]), right = fx[i + 1] * (v[i] - v[i + 1]);
    const float above = fy[i] * (v[i] - v[i - up]), below = fy[i + up] * (v[i] - v[i + up]);
    const float drop = 1.0f - v[i];
    q[i] = (half_s * (left * left + right * right) + half_t * (above * above + below * below)) / (s[i] + kTiny) +
           (contact[i] - lost[i]) * drop * drop;
  }
}

/// Sum of the lanes: the second half is added to the first one until one is left.
template <int kWidth>
[[gnu::always_inline]] inline float Folded(float* lane) {
  if constexpr (kWidth > 1) {
    for (int l = 0; l < kWidth / 2; ++l) lane[l] += lane[l + kWidth / 2];
    return Folded<kWidth / 2>(lane);
  }
  return lane[0];
}

/// Power into the sheet, heat in it, power lost at the contact and power into ground, at 1 V [W/V^2].
struct Balance {
  double in = 0, heat = 0, lost = 0, grounded = 0;
};

FULCRUM_WIDE
void AddRow(const float* __restrict contact, const float* __restrict lost, const float* __restrict ground,
            const float* __restrict v, const float* __restrict q, Balance* balance) {
  alignas(64) float in[kLanes] = {}, heat[kLanes] = {}, lost_lane[kLanes] = {}, grounded[kLanes] = {};
  for (int i = 0; i < kWindow; i += kLanes) {
    for (int l = 0; l < kLanes; ++l) {
      in[l] += contact[i + l] * (1.0f - v[i + l]);
      heat[l] += q[i + l];
      lost_lane[l] += lost[i + l] * (1.0f - v[i + l]) * (1.0f - v[i + l]);
      grounded[l] += ground[i + l] * v[i + l] * v[i + l];
    }
  }
  balance->in += Folded<kLanes>(in);
  balance->heat += Folded<kLanes>(heat);
  balance->lost += Folded<kLanes>(lost_lane);
  balance->grounded += Folded<kLanes>(grounded);
}

}  // namespace

struct PotentialSolver::Multigrid {
  Grid<kWindow> grid;
  alignas(64) Field v{};  ///< Solution, and start of the next solve.
  alignas(64) Field p{}, ap{}, contact{}, sigma{};
};

PotentialSolver::PotentialSolver() : grid_(std::make_unique<Multigrid>()) {}
PotentialSolver::~PotentialSolver() = default;

float PotentialSolver::Voltage(int i, int j) const { return grid_->v[Fine::At(i, j)]; }

PotentialResult PotentialSolver::Solve(const PotentialProblem& problem, float tolerance) {
  Fine& fine = grid_->grid.level;
  for (int j = 0; j < kWindow; ++j) {
    const int o = Fine::At(0, j), k = j * kWindow;
    std::copy_n(&problem.sigma[k], kWindow, &grid_->sigma[o]);
    std::copy_n(&problem.contact[k], kWindow, &grid_->contact[o]);
    std::transform(&problem.contact[k], &problem.contact[k] + kWindow, &problem.ground[k], &fine.mass[o], std::plus{});
  }
  SetFaces(grid_->sigma, problem.face_s, problem.face_t, &fine);
  SetUp(&grid_->grid);

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
  Fine& fine = g.grid.level;
  const float contact_sum = Sum(g.contact);
  if (!(contact_sum > 0.0f)) {
    std::fill(g.v.begin(), g.v.end(), 0.0f);
    return 0;
  }
  // fine.b holds the residual r, the input of the V-cycle; fine.z holds its result.
  Apply(fine, g.v, &g.ap);
  fine.b = g.contact;
  Add(-1.0f, g.ap, &fine.b);
  float rz = 0;
  for (int k = 0; k < kMaxIterations; ++k) {
    VCycle(&g.grid);
    const float rz_new = Dot(fine.b, fine.z);
    // r.z estimates the energy of the error, the conductance is the energy of the solution.
    const float conductance = contact_sum - Dot(g.contact, g.v);
    const bool last = !(rz_new > tolerance * tolerance * conductance);
    if (!(rz_new > 0.0f)) return k;
    ScaleAdd(fine.z, k == 0 ? 0.0f : rz_new / rz, &g.p);
    rz = rz_new;
    Apply(fine, g.p, &g.ap);
    const float alpha = rz / Dot(g.p, g.ap);
    Add(alpha, g.p, &g.v);
    if (last) return k + 1;  // the V-cycle is computed already, so its step is taken
    Add(-alpha, g.ap, &fine.b);
  }
  return kMaxIterations;
}

PotentialResult PotentialSolver::Evaluate(const PotentialProblem& problem) {
  Multigrid& g = *grid_;
  const Fine& fine = g.grid.level;
  Balance balance;
  for (int j = 0; j < kWindow; ++j) {
    const float* contact = &problem.contact[j * kWindow];
    float* q = &heat_[j * kWindow];
    const float* lost_row = &problem.lost[j * kWindow];
    RowHeat(fine, g.v, g.sigma, problem.face_s, problem.face_t, j, contact, lost_row, q);
    const double before = balance.heat;
    AddRow(contact, lost_row, &problem.ground[j * kWindow], &g.v[Fine::At(0, j)], q, &balance);
    row_heat_[j] = static_cast<float>(balance.heat - before);
  }
  const auto& [in, heat, lost, grounded] = balance;
  PotentialResult result;
  if (!(in > 0.0) || !std::isfinite(in + heat + lost + grounded)) {
    // No contact, or a value that is not finite: the result is 0 and the next solve starts from 0.
    heat_.fill(0);
    row_heat_.fill(0);
    std::fill(g.v.begin(), g.v.end(), 0.0f);
    return result;
  }
  const double out = heat + lost + grounded;
  result.conductance_S = static_cast<float>(in);
  result.imbalance = static_cast<float>(std::abs(in - out) / in);
  result.scale = in / out;
  const auto scale = static_cast<float>(result.scale);
  Scale(scale, heat_);
  Scale(scale, row_heat_);
  result.heat_S = heat * static_cast<double>(scale);
  result.lost_S = lost * static_cast<double>(scale);
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
    for (int i = 0; i < kWindow; ++i) grid_->v[Fine::At(i, j)] = start[j * kWindow + i];
  }
}

void PotentialSolver::Shift(int di, int dj) {
  if (di == 0 && dj == 0) return;
  std::array<float, kWindowCells> before, after{};
  ExportStart(&before);
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) {
      // Cells that enter at the border take the value of the nearest old cell.
      const int from_i = std::clamp(i + di, 0, kWindow - 1);
      const int from_j = std::clamp(j + dj, 0, kWindow - 1);
      after[j * kWindow + i] = before[from_j * kWindow + from_i];
    }
  }
  ImportStart(after);
}

}  // namespace fulcrum::thermal
