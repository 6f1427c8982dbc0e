#include "tests/numerics/thermal/electrode_current.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "thermal_node/coupling/electrode.h"
#include "thermal_node/coupling/source_window.h"

namespace fulcrum::thermal {
namespace {

/// Borders of cells from 0 on: of `fine` up to `core`, then each 3 % wider than the last, to `end`.
std::vector<double> Grid(double fine, double core, double end) {
  std::vector<double> border{0};
  for (double width = fine; border.back() < end; width *= border.back() < core ? 1.0 : 1.03) {
    border.push_back(border.back() + width);
  }
  return border;
}

/// Contact of a point over that of covered tissue; the capsule's axis lies along x around 0.
double CoverageAt(const CapsuleOnSheet& capsule, double x, double y) {
  const double beyond = std::hypot(std::max(std::abs(x) - 0.5 * capsule.length_m, 0.0), y) - capsule.radius_m;
  if (beyond <= 0) return 1;
  const double rarer = std::max(1 - beyond / capsule.arc_m, 0.0);
  return static_cast<double>(kArcConductance) * rarer * rarer;
}

/// Mean over a cell, by midpoints of its 4 x 4 parts.
double MeanCoverage(const CapsuleOnSheet& capsule, double x0, double x1, double y0, double y1) {
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i)
      sum += CoverageAt(capsule, x0 + (i + 0.5) / 4 * (x1 - x0), y0 + (j + 0.5) / 4 * (y1 - y0));
  }
  return sum / 16;
}

struct SheetConstants {
  explicit SheetConstants(const Material& m)
      : conductance(static_cast<double>(m.sigma) * m.thickness_m),
        leak(m.leak_S_m2),
        contact(2.0 * m.sigma / m.thickness_m) {}
  double conductance;  ///< sigma d [S].
  double leak;         ///< To the tissue beneath [S/m^2].
  double contact;      ///< Under the metal [S/m^2].
};

}  // namespace

double ReferenceConductance(const Material& material, const CapsuleOnSheet& capsule, double core_m) {
  const SheetConstants sheet(material);
  const double reach = capsule.radius_m + capsule.arc_m;
  const double end = reach + 0.5 * capsule.length_m + 8 * std::sqrt(sheet.conductance / sheet.leak);
  const std::vector<double> x = Grid(core_m, reach + 0.5 * capsule.length_m, end), y = Grid(core_m, reach, end);
  const int nx = static_cast<int>(x.size()) - 1, ny = static_cast<int>(y.size()) - 1;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd contact(nx * ny);
  const auto face = [&](int a, int b, double conductance) {
    entries.insert(entries.end(),
                   {{a, a, conductance}, {b, b, conductance}, {a, b, -conductance}, {b, a, -conductance}});
  };
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int k = j * nx + i;
      const double dx = x[i + 1] - x[i], dy = y[j + 1] - y[j];
      contact[k] = sheet.contact * dx * dy * MeanCoverage(capsule, x[i], x[i + 1], y[j], y[j + 1]);
      entries.emplace_back(k, k, contact[k] + sheet.leak * dx * dy);
      if (i + 1 < nx) face(k, k + 1, sheet.conductance * dy / (0.5 * (x[i + 2] - x[i])));
      if (j + 1 < ny) face(k, k + nx, sheet.conductance * dx / (0.5 * (y[j + 2] - y[j])));
    }
  }
  Eigen::SparseMatrix<double> matrix(nx * ny, nx * ny);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  const Eigen::VectorXd voltage = factor.solve(contact);
  return 4 * (contact.sum() - contact.dot(voltage));
}

double DiscConductance(const Material& material, double radius_m) {
  // V = v0 + a I0(mu r) under the metal, b K0(r / lambda) beside it; V and its slope are continuous at the edge.
  const SheetConstants sheet(material);
  const double mu = std::sqrt((sheet.contact + sheet.leak) / sheet.conductance);
  const double per_lambda = std::sqrt(sheet.leak / sheet.conductance);
  const double v0 = sheet.contact / (sheet.contact + sheet.leak);
  const double inside = mu * radius_m, outside = per_lambda * radius_m;
  const double b_of_a = -mu * std::cyl_bessel_i(1.0, inside) / (per_lambda * std::cyl_bessel_k(1.0, outside));
  const double a = v0 / (b_of_a * std::cyl_bessel_k(0.0, outside) - std::cyl_bessel_i(0.0, inside));
  // Integral of contact (1 - V) over the disc.
  return 2 * std::numbers::pi * sheet.contact *
         (0.5 * radius_m * radius_m * (1 - v0) - a * radius_m * std::cyl_bessel_i(1.0, inside) / mu);
}

double WindowConductance(const Material& material, const CapsuleOnSheet& capsule, float heading,
                         const Vec2f& from_node) {
  const float side = 2.0f * kWindow * material.cell_m;
  HeatField field(MakeFlatSheet(side, side, material.cell_m), material);
  SourceWindow window(field.material(), field.sheet());
  window.tolerance = 1e-4f;
  TipPath path;
  path.half = static_cast<float>(0.5 * capsule.length_m) * Vec2f(std::cos(heading), std::sin(heading));
  path.from = path.to = material.cell_m * (Vec2f::Constant(kWindow) + from_node);
  path.radius_m = static_cast<float>(capsule.radius_m);
  Ledger ledger;
  // One volt for a moment: the tissue stays as it is.
  window.Run(
      &field, path,
      {.power_W = 1, .v_max_V = 1, .i_max_A = 1, .remove_theta = 1e3f, .arc_m = static_cast<float>(capsule.arc_m)},
      1e-6f, &ledger);
  return window.stats().current_A / window.stats().voltage_V;
}

DiscInDepth SolveDiscInDepth(const Material& material, double radius_m, double rim_m) {
  // Borders from 0 on, each cell wider than the last by `growth` up to `widest`, to `end`.
  const auto graded = [](double first, double growth, double widest, double end) {
    std::vector<double> border{0};
    for (double width = first; border.back() < end; width = std::min(width * growth, widest)) {
      border.push_back(std::min(border.back() + width, end));
    }
    return border;
  };
  const double thickness = material.thickness_m, depth = material.fat_depth_m;
  constexpr double kFar_m = 0.06;
  std::vector<double> r, z;
  const std::vector<double> inner = graded(rim_m, 1.12, radius_m / 8, radius_m);
  for (auto at = inner.rbegin(); at != inner.rend(); ++at) r.push_back(radius_m - *at);
  for (const double at : graded(rim_m, 1.06, 2e-3, kFar_m)) r.push_back(radius_m + at);
  r.erase(std::unique(r.begin(), r.end()), r.end());
  z = graded(rim_m, 1.15, thickness / 6, thickness);
  const auto layers = static_cast<Eigen::Index>(z.size()) - 1;  // of the sheet
  for (const double at : graded(thickness / 10, 1.12, depth / 12, depth)) z.push_back(thickness + at);
  z.erase(std::unique(z.begin(), z.end()), z.end());
  const auto nr = static_cast<Eigen::Index>(r.size()) - 1, nz = static_cast<Eigen::Index>(z.size()) - 1;
  const double fat = static_cast<double>(material.leak_S_m2) * depth;
  const auto sigma = [&](Eigen::Index k) { return k < layers ? static_cast<double>(material.sigma) : fat; };
  const auto width = [&](Eigen::Index k) {
    return z[static_cast<std::size_t>(k) + 1] - z[static_cast<std::size_t>(k)];
  };
  const auto middle = [&](Eigen::Index i) {
    return 0.5 * (r[static_cast<std::size_t>(i)] + r[static_cast<std::size_t>(i) + 1]);
  };
  const auto area = [&](Eigen::Index i) {
    const double a = r[static_cast<std::size_t>(i)], b = r[static_cast<std::size_t>(i) + 1];
    return std::numbers::pi * (b * b - a * a);
  };
  const auto half = [&](Eigen::Index i, Eigen::Index k) {
    return 2 * area(i) * sigma(k) / width(k);
  };  // of a cell, along z
  const auto covered = [&](Eigen::Index i) { return r[static_cast<std::size_t>(i) + 1] <= radius_m * (1 + 1e-9); };
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(nr * nz), current = diagonal;
  const auto join = [&](Eigen::Index p, Eigen::Index q, double conductance) {
    entries.emplace_back(p, q, -conductance);
    entries.emplace_back(q, p, -conductance);
    diagonal[p] += conductance;
    diagonal[q] += conductance;
  };
  for (Eigen::Index k = 0; k < nz; ++k) {
    for (Eigen::Index i = 0; i < nr; ++i) {
      const Eigen::Index p = k * nr + i;
      if (i + 1 < nr) join(p, p + 1, 2 * std::numbers::pi * sigma(k) * width(k) / std::log(middle(i + 1) / middle(i)));
      if (k + 1 < nz) {
        join(p, p + nr, 1 / (1 / half(i, k) + 1 / half(i, k + 1)));
      } else {
        diagonal[p] += half(i, k);  // the conductor
      }
      if (k == 0 && covered(i)) {
        diagonal[p] += half(i, k);
        current[p] = half(i, k);
      }
    }
  }
  for (Eigen::Index p = 0; p < nr * nz; ++p) entries.emplace_back(p, p, diagonal[p]);
  Eigen::SparseMatrix<double> matrix(nr * nz, nr * nz);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd v = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(current);
  DiscInDepth result;
  double into_fat = 0;
  for (Eigen::Index i = 0; i < nr; ++i) {
    result.conductance_S += current[i] * (1 - v[i]);
    const Eigen::Index above = (layers - 1) * nr + i;
    const double a = half(i, layers - 1), b = half(i, layers), through = (v[above] - v[above + nr]) / (1 / a + 1 / b);
    into_fat += through * (v[above] - through / a);
  }
  result.sheet_share = 1 - into_fat / result.conductance_S;
  return result;
}

EnergyShares SharesOfEnergy(const Material& material, bool tented) {
  const float side = 20e-3f;
  HeatField field(MakeFlatSheet(side, side, material.cell_m), material);
  SourceWindow window(field.material(), field.sheet());
  window.KeepLeak();
  TipPath path;
  path.from = path.to = {0.5f * side, 0.5f * side};
  path.radius_m = 5e-4f;
  path.tented = tented;
  Ledger ledger;
  window.Run(&field, path, {.power_W = 30, .v_max_V = 350, .i_max_A = 2, .remove_theta = 1e3f, .arc_m = 4e-4f}, 1e-3f,
             &ledger);
  const double within = ledger.joule;
  window.DepositFar(&field, false, &ledger);
  const double beneath = window.stats().leak_J + window.stats().far_leak_J;
  const double all = ledger.generator;
  return {ledger.joule / all, (ledger.joule - within) / all, beneath / all,
          (all - ledger.joule - ledger.film - beneath) / all};
}

}  // namespace fulcrum::thermal
