// The linear solve of a substep on the device, and the linearisation of the membrane: products, curvature, vector
// operations and the membrane's part of the preconditioner there; hats, coarse nodes, the organ's preconditioner and
// the coefficients of conjugate gradients on the host.
#pragma once

#include <vector>

#include "tests/benchmark/gpu_prototype/device.h"
#include "tests/benchmark/gpu_prototype/host_case.h"

namespace fulcrum::physics::gpu_prototype {

/// As the host rounds, or with products and sums fused.
enum class Rounding { kAsHost, kFused };
enum class Product { kOneLaunch, kTwoLaunches };

/// Sums over the tasks, one after the other as the host adds them.
struct Dots {
  double sheet = 0, organ = 0;
  double all = 0;  ///< Membrane, then organ, in one sum.
};

class DeviceSolve {
 public:
  /// Compiles the kernels for the case and copies its matrix. Both must outlive this.
  DeviceSolve(Device* device, HostCase* host, Rounding rounding = Rounding::kAsHost);

  /// q <- A z for z of the host's Krylov z.
  void SetDirection(const FloatArray& z);
  void ApplySheet(Product how);
  void ApplyOrgan();
  /// p . A p of the last product, in the host's order. Waits.
  Dots ReadDots();
  void ReadProduct(FloatArray* q);

  /// The membrane's linearisation at the host's linearisation point, in two launches: matrix, residual without bindings
  /// and hinges, diagonal blocks.
  void Linearise();
  /// Planes kt[3], along[3], residual[3], inverse blocks[6], coupling[2][3] of the last Linearise.
  [[nodiscard]] std::vector<float> ReadLinearisation();

  /// Two iterations from the host's residual; `d` <- the correction. The steps of LinearSolver::Solve(2).
  void Solve(FloatArray* d);
  /// The launches of a Solve without its transfers and without the host's part: the sequence that a backend with
  /// everything on the device would queue. Does not wait.
  void Queue();

 private:
  void CopyLaw(const implicit::Sheet& sheet);
  void Restrict();
  void Precondition();
  /// Sums of `dots` by task. `parity` as in the kernel LaneSums.
  void SumSheet(bool parity);
  void SumOrgan();
  void ReadSheet() { device_.Read(sheet_partial_, 0, sheet_sums_.data(), sheet_sums_.size()); }
  void ReadOrgan() { device_.Read(organ_partial_, 0, organ_sums_.data(), organ_sums_.size()); }
  /// Of all tasks, one after the other as the host adds them.
  [[nodiscard]] Dots Sums() const;
  /// Hats, coarse nodes and the organ's part of z and r . z for the present residual, on the host.
  void ExchangeLevels();
  void Curvature();

  Device& device_;
  HostCase& host_;
  const float inertia_;
  std::size_t plane_, field_, tube_, vertices_, rows_, sums_;
  std::vector<int> sheet_bounds_, organ_bounds_;
  std::vector<double> sheet_sums_, organ_sums_;

  Buffer matrix_, levels_, hat_weights_, hat_cell_, hat_fraction_, hat_value_, row_sums_;
  Buffer organ_c_, organ_f_, organ_mass_, start_, vertex_, gradient_, patch_start_, patch_, patch_gradient_;
  Buffer sheet_bounds_of_tasks_, organ_bounds_of_tasks_;
  Buffer law_, fields_, triangles_, linearised_;
  Buffer r_, z_, p_, q_, d_, pulls_, lines_, sheet_dots_, organ_dots_, lanes_, sheet_partial_, organ_partial_;
};

}  // namespace fulcrum::physics::gpu_prototype
