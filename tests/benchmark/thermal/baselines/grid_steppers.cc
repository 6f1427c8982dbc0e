#include "tests/benchmark/thermal/baselines/grid_steppers.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

using Field = std::vector<float>;

constexpr int kBlock = 16;  ///< Block size of the transposition.

/// out = u + r (sum of the neighbours' differences along rows and columns, as selected by the flags).
template <bool kAlongRow, bool kAcrossRows>
inline void Explicit(int n, float r, const float* __restrict u, float* __restrict out) {
  for (int j = 0; j < n; ++j) {
    const float* row = u + static_cast<std::ptrdiff_t>(j) * n;
    const float* above = j > 0 ? row - n : row;
    const float* below = j + 1 < n ? row + n : row;
    float* to = out + static_cast<std::ptrdiff_t>(j) * n;
    if constexpr (kAcrossRows) {
      for (int i = 0; i < n; ++i) to[i] = row[i] + r * (above[i] - 2.0f * row[i] + below[i]);
    } else {
      std::copy_n(row, n, to);
    }
    if constexpr (kAlongRow) {
      to[0] += r * (row[1] - row[0]);
      for (int i = 1; i + 1 < n; ++i) to[i] += r * (row[i - 1] - 2.0f * row[i] + row[i + 1]);
      to[n - 1] += r * (row[n - 2] - row[n - 1]);
    }
  }
}

FULCRUM_WIDE void ExplicitBoth(int n, float r, const float* u, float* out) { Explicit<true, true>(n, r, u, out); }
FULCRUM_WIDE void ExplicitAcross(int n, float r, const float* u, float* out) { Explicit<false, true>(n, r, u, out); }

class ForwardEuler final : public GridStepper {
 public:
  explicit ForwardEuler(const UniformGrid& grid) : grid_(grid), next_(static_cast<std::size_t>(grid.n) * grid.n) {}

  void Step(Field* theta, const Field& heating, double dt_s) override {
    for (std::size_t k = 0; k < next_.size(); ++k) (*theta)[k] += heating[k];
    const double number = grid_.diffusivity_m2_s * dt_s / (grid_.cell_m * grid_.cell_m);
    const int substeps = std::max(1, static_cast<int>(std::ceil(4 * number)));
    for (int n = 0; n < substeps; ++n) {
      ExplicitBoth(grid_.n, static_cast<float>(number / substeps), theta->data(), next_.data());
      theta->swap(next_);
    }
  }

 private:
  UniformGrid grid_;
  Field next_;
};

/// u = (I - r D)^-1 u for every column, D the second difference across rows; by Thomas' elimination, whose factors are
/// the same for all columns.
class ColumnSolver {
 public:
  void Prepare(int n, double r) {
    n_ = n;
    r_ = static_cast<float>(r);
    inverse_.resize(n);
    carry_.resize(n);
    double above = 0;
    for (int j = 0; j < n; ++j) {
      const double diagonal = 1 + (j == 0 || j + 1 == n ? r : 2 * r);
      const double pivot = diagonal - r * above;
      above = r / pivot;
      inverse_[j] = static_cast<float>(1 / pivot);
      carry_[j] = static_cast<float>(above);
    }
  }
  FULCRUM_WIDE void Solve(float* __restrict u) const {
    for (int i = 0; i < n_; ++i) u[i] *= inverse_[0];
    for (int j = 1; j < n_; ++j) {
      float* row = u + static_cast<std::ptrdiff_t>(j) * n_;
      const float* above = row - n_;
      for (int i = 0; i < n_; ++i) row[i] = (row[i] + r_ * above[i]) * inverse_[j];
    }
    for (int j = n_ - 2; j >= 0; --j) {
      float* row = u + static_cast<std::ptrdiff_t>(j) * n_;
      const float* below = row + n_;
      for (int i = 0; i < n_; ++i) row[i] += carry_[j] * below[i];
    }
  }

 private:
  int n_ = 0;
  float r_ = 0;
  Field inverse_, carry_;
};

FULCRUM_WIDE void Transpose(int n, const float* __restrict in, float* __restrict out) {
  for (int bj = 0; bj < n; bj += kBlock) {
    for (int bi = 0; bi < n; bi += kBlock) {
      for (int j = bj; j < bj + kBlock; ++j) {
        for (int i = bi; i < bi + kBlock; ++i) out[i * n + j] = in[j * n + i];
      }
    }
  }
}

class AlternatingDirections final : public GridStepper {
 public:
  explicit AlternatingDirections(const UniformGrid& grid)
      : grid_(grid), right_(static_cast<std::size_t>(grid.n) * grid.n), turned_(right_), solved_(right_) {}

  //   (I - r Dx) u* = (I + r Dy) u + s/2,   (I - r Dy) u' = (I + r Dx) u* + s/2,   r = alpha dt / (2 h^2)
  // The first line gives the second one's right hand side without another difference: (I + r Dx) u* = 2 u* - right.
  void Step(Field* theta, const Field& heating, double dt_s) override {
    const int n = grid_.n;
    const double r = 0.5 * grid_.diffusivity_m2_s * dt_s / (grid_.cell_m * grid_.cell_m);
    column_.Prepare(n, r);
    ExplicitAcross(n, static_cast<float>(r), theta->data(), right_.data());
    for (std::size_t k = 0; k < right_.size(); ++k) right_[k] += 0.5f * heating[k];
    Transpose(n, right_.data(), turned_.data());
    solved_ = turned_;
    column_.Solve(solved_.data());
    for (std::size_t k = 0; k < right_.size(); ++k) turned_[k] = 2.0f * solved_[k] - turned_[k];
    Transpose(n, turned_.data(), theta->data());
    for (std::size_t k = 0; k < right_.size(); ++k) (*theta)[k] += 0.5f * heating[k];
    column_.Solve(theta->data());
  }

 private:
  UniformGrid grid_;
  ColumnSolver column_;
  Field right_, turned_, solved_;
};

class CrankNicolson final : public GridStepper {
 public:
  explicit CrankNicolson(const UniformGrid& grid)
      : grid_(grid), residual_(static_cast<std::size_t>(grid.n) * grid.n), along_(residual_), image_(residual_) {}

  void Step(Field* theta, const Field& heating, double dt_s) override {
    constexpr double kTolerance = 1e-5;
    constexpr int kMaxIterations = 200;
    const int n = grid_.n;
    const auto r = static_cast<float>(0.5 * grid_.diffusivity_m2_s * dt_s / (grid_.cell_m * grid_.cell_m));
    // right = u + r L u + s; residual of the guess u: right - (u - r L u) = 2 r L u + s.
    ExplicitBoth(n, r, theta->data(), image_.data());
    double right2 = 0, rho = 0;
    for (std::size_t k = 0; k < image_.size(); ++k) {
      const float right = image_[k] + heating[k];
      residual_[k] = 2.0f * (image_[k] - (*theta)[k]) + heating[k];
      right2 += static_cast<double>(right) * right;
      rho += static_cast<double>(residual_[k]) * residual_[k];
    }
    along_ = residual_;
    for (int iteration = 0; iteration < kMaxIterations && rho > kTolerance * kTolerance * right2; ++iteration) {
      ExplicitBoth(n, -r, along_.data(), image_.data());
      const auto step = static_cast<float>(rho / Dot(along_, image_));
      Update(step, theta->data());
      const double next = Dot(residual_, residual_);
      const auto keep = static_cast<float>(next / rho);
      rho = next;
      for (std::size_t k = 0; k < along_.size(); ++k) along_[k] = residual_[k] + keep * along_[k];
    }
  }

 private:
  FULCRUM_WIDE static double Dot(const Field& a, const Field& b) {
    alignas(64) float lane[kBlock] = {};
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); k += kBlock) {
      for (int i = 0; i < kBlock; ++i) lane[i] += a[k + i] * b[k + i];
    }
    for (const float l : lane) sum += l;
    return sum;
  }
  FULCRUM_WIDE void Update(float step, float* __restrict theta) {
    float* __restrict residual = residual_.data();
    const float* __restrict along = along_.data();
    const float* __restrict image = image_.data();
    for (std::size_t k = 0; k < residual_.size(); ++k) {
      theta[k] += step * along[k];
      residual[k] -= step * image[k];
    }
  }

  UniformGrid grid_;
  Field residual_, along_, image_;
};

}  // namespace

std::unique_ptr<GridStepper> MakeForwardEuler(const UniformGrid& grid) { return std::make_unique<ForwardEuler>(grid); }
std::unique_ptr<GridStepper> MakeAlternatingDirections(const UniformGrid& grid) {
  return std::make_unique<AlternatingDirections>(grid);
}
std::unique_ptr<GridStepper> MakeCrankNicolson(const UniformGrid& grid) {
  return std::make_unique<CrankNicolson>(grid);
}

}  // namespace fulcrum::thermal
