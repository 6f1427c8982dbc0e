#include "tests/numerics/thermal/heat_cases.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace fulcrum::thermal {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kLength = 6.4e-3f;

/// theta = e^(-t / tau) (30 + 10 cos(a x) cos(2 a y)) where water is 0.6 + 0.3 cos(a x) cos(a y), a = pi / L.
class Variable {
 public:
  Variable(float cell_m, float dt_s) : dt_s_(dt_s), field_(MakeFlatSheet(kLength, kLength, cell_m), Wet(cell_m)) {
    Fill(&field_, [](double, double) { return 0.0; });
    for (Tile* tile : field_.awake()) {
      for (int k = 0; k < kTileCells; ++k) {
        if ((tile->state.flags[k] & kNoTissue) != 0) continue;
        const Vec2f p = Centre(*tile, k);
        tile->state.water[k] = static_cast<float>(Water(p.x(), p.y()));
      }
      tile->material_stale = true;
    }
    Fill(&field_, [](double x, double y) { return Exact(x, y, 0); });
  }
  void Run(double seconds) {
    const int steps = static_cast<int>(std::lround(seconds / dt_s_));
    Ledger ledger;
    for (int n = 0; n < steps; ++n) {
      AddSource((n + 0.25) * dt_s_);
      field_.Diffuse(dt_s_, &ledger);
      AddSource((n + 0.75) * dt_s_);
    }
  }
  [[nodiscard]] double Error(double seconds) const {
    double worst = 0, highest = 0;
    ForCells(field_, [&](double theta, double x, double y) {
      worst = std::max(worst, std::abs(theta - Exact(x, y, seconds)));
      highest = std::max(highest, Exact(x, y, seconds));
    });
    return worst / highest;
  }
  [[nodiscard]] std::vector<double> Theta() const {
    std::vector<double> all;
    ForCells(field_, [&](double theta, double, double) { all.push_back(theta); });
    return all;
  }

 private:
  static constexpr double kTau = 0.3, kA = kPi / kLength;
  static Material Wet(float cell_m) {
    ThermalParams params;
    params.cell_m = cell_m;
    return MakeMaterial(params);
  }
  static double Water(double x, double y) { return 0.6 + 0.3 * std::cos(kA * x) * std::cos(kA * y); }
  static double Exact(double x, double y, double t) {
    return std::exp(-t / kTau) * (30 + 10 * std::cos(kA * x) * std::cos(2 * kA * y));
  }
  [[nodiscard]] Vec2f Centre(const Tile& tile, int k) const {
    return field_.sheet().CentreOf({tile.tx * kTile + k % kTile, tile.ty * kTile + k / kTile});
  }
  /// rc d theta/dt - div(k grad theta) + loss theta.
  [[nodiscard]] double Source(double x, double y, double t) const {
    const Material& m = field_.material();
    const double w = Water(x, y), fade = std::exp(-t / kTau);
    const double rc = m.rc_dry + w * (m.rc_wet - m.rc_dry), k = m.k_dry + w * (m.k_wet - m.k_dry);
    const double cx = std::cos(kA * x), sx = std::sin(kA * x), cy = std::cos(kA * y), sy = std::sin(kA * y),
                 c2y = std::cos(2 * kA * y), s2y = std::sin(2 * kA * y);
    const double slope = m.k_wet - m.k_dry;
    const double kx = -slope * 0.3 * kA * sx * cy, ky = -slope * 0.3 * kA * cx * sy;
    const double ux = -10 * fade * kA * sx * c2y, uy = -20 * fade * kA * cx * s2y;
    const double laplacian = -50 * fade * kA * kA * cx * c2y;
    const double u = Exact(x, y, t);
    return -rc * u / kTau - (kx * ux + ky * uy + k * laplacian) + m.loss_resting * u;
  }
  /// Adds the source of half a step, by its value in the middle.
  void AddSource(double t) {
    Ledger ledger;
    for (Tile* tile : field_.awake()) {
      for (int k = 0; k < kTileCells; ++k) {
        if ((tile->state.flags[k] & kNoTissue) != 0) continue;
        const Vec2f p = Centre(*tile, k);
        tile->state.enthalpy[k] += static_cast<float>(0.5 * dt_s_ * Source(p.x(), p.y(), t));
      }
      field_.RefreshTheta(tile, &ledger);
    }
  }

  float dt_s_;
  HeatField field_;
};

/// A patch of a sphere under a gnomonic map whose axes are not at right angles, and on it a bump that fades,
/// theta = 10 + e^(-t / tau) 40 ((z - z0) / (1 - z0))^5 for z > z0, where z is the cosine of the angle from the middle:
/// smooth, and flat well within the border. On a sphere of radius R, div grad f(z) = ((1 - z^2) f')' / R^2.
class Sphere {
 public:
  Sphere(float cell_m, float dt_s) : dt_s_(dt_s), field_(Patch(cell_m), Lossless(cell_m)) {
    Fill(&field_, [](double x, double y) { return Exact(Height(x, y), 0); });
  }
  void Run(double seconds) {
    const int steps = static_cast<int>(std::lround(seconds / dt_s_));
    Ledger ledger;
    for (int n = 0; n < steps; ++n) {
      AddSource((n + 0.25) * dt_s_);
      field_.Diffuse(dt_s_, &ledger);
      AddSource((n + 0.75) * dt_s_);
    }
  }
  [[nodiscard]] double Error(double seconds) const {
    double worst = 0;
    ForCells(field_, [&](double theta, double x, double y) {
      worst = std::max(worst, std::abs(theta - Exact(Height(x, y), seconds)));
    });
    return worst / Exact(1, seconds);
  }

 private:
  using Vec3d = Eigen::Vector3d;
  static constexpr double kRadius = 8e-3, kSkew = 0.5, kTau = 0.5, kEdge = 0.94;
  static Material Lossless(float cell_m) {
    ThermalParams params;
    params.cell_m = cell_m;
    params.h_top_W_m2K = params.h_below_W_m2K = params.h_tented_W_m2K = params.perfusion_per_s = 0;
    return MakeMaterial(params);
  }
  /// Point of the tangent plane [m] for material (x, y).
  static Vec3d Plane(double x, double y) {
    const double u = x - kLength, v = y - kLength;
    return {u + kSkew * v, v, kRadius};
  }
  static double Height(double x, double y) { return kRadius / Plane(x, y).norm(); }
  static SurfaceMetric MetricAt(const Vec2f& p) {
    const Vec3d plane = Plane(p.x(), p.y());
    const double length = plane.norm();
    // d/dx of R plane / |plane|.
    const auto along = [&](const Vec3d& d) -> Vec3d {
      return kRadius * (d / length - plane * (plane.dot(d) / (length * length * length)));
    };
    const Vec3d s = along({1, 0, 0}), t = along({kSkew, 1, 0});
    return {static_cast<float>(s.squaredNorm()), static_cast<float>(s.dot(t)), static_cast<float>(t.squaredNorm())};
  }
  static Sheet Patch(float cell_m) {
    Sheet sheet = MakeFlatSheet(2 * kLength, 2 * kLength, cell_m);
    SetMetric(&sheet, MetricAt);
    return sheet;
  }
  static double Bump(double z, int power) { return std::pow(std::max(0.0, (z - kEdge) / (1 - kEdge)), power); }
  /// The base temperature keeps tiles under the foot of the bump awake.
  static double Exact(double z, double t) { return 10 + 40 * std::exp(-t / kTau) * Bump(z, 5); }
  /// rc d theta/dt - k div grad theta.
  [[nodiscard]] double Source(double z, double t) const {
    const Material& m = field_.material();
    const double scale = 40 * std::exp(-t / kTau), w = 1 / (1 - kEdge);
    const double first = scale * 5 * w * Bump(z, 4), second = scale * 20 * w * w * Bump(z, 3);
    const double laplacian = ((1 - z * z) * second - 2 * z * first) / (kRadius * kRadius);
    return -m.rc_wet * (Exact(z, t) - 10) / kTau - m.k_wet * laplacian;
  }
  /// Adds the source of half a step, by its value in the middle.
  void AddSource(double t) {
    Ledger ledger;
    for (Tile* tile : field_.awake()) {
      for (int k = 0; k < kTileCells; ++k) {
        if ((tile->state.flags[k] & kNoTissue) != 0) continue;
        const Vec2f p = field_.sheet().CentreOf({tile->tx * kTile + k % kTile, tile->ty * kTile + k / kTile});
        tile->state.enthalpy[k] += static_cast<float>(0.5 * dt_s_ * Source(Height(p.x(), p.y()), t));
      }
      field_.RefreshTheta(tile, &ledger);
    }
  }

  float dt_s_;
  HeatField field_;
};

}  // namespace

double ModeError(float cell_m, float dt_s) {
  ThermalParams params;
  params.cell_m = cell_m;
  const Material material = MakeMaterial(params);
  HeatField field(MakeFlatSheet(kLength, kLength, cell_m), material);
  const double kx = kPi / kLength, ky = 2 * kPi / kLength;
  Fill(&field, [&](double x, double y) { return 30 + 20 * std::cos(kx * x) * std::cos(ky * y); });
  const double alpha = material.k_wet / material.rc_wet, loss = material.loss_resting / material.rc_wet;
  const double time = 2.0;
  Ledger ledger;
  const int steps = static_cast<int>(std::lround(time / dt_s));
  for (int n = 0; n < steps; ++n) field.Diffuse(dt_s, &ledger);
  double worst = 0;
  ForCells(field, [&](double theta, double x, double y) {
    const double mode =
        20 * std::exp(-(alpha * (kx * kx + ky * ky) + loss) * time) * std::cos(kx * x) * std::cos(ky * y);
    worst = std::max(worst, std::abs(theta - 30 * std::exp(-loss * time) - mode) / 20);
  });
  return worst;
}

double VariableError(float cell_m, float dt_s) {
  Variable problem(cell_m, dt_s);
  problem.Run(0.24);
  return problem.Error(0.24);
}

double SphereError(float cell_m, float dt_s) {
  Sphere problem(cell_m, dt_s);
  problem.Run(0.24);
  return problem.Error(0.24);
}

double StefanError(float cell_m, double time_s) {
  constexpr double kWall_K = 350;
  ThermalParams params;
  params.cell_m = cell_m;
  params.h_top_W_m2K = params.h_below_W_m2K = params.h_tented_W_m2K = params.perfusion_per_s = 0;
  const Material material = MakeMaterial(params);
  HeatField field(MakeFlatSheet(kLength, kTile * cell_m, cell_m), material);
  Fill(&field, [](double, double) { return 0.0; });
  Ledger ledger;
  // The wall stands between the first two columns: each cell of the first is dry and so hot that the flux to its
  // neighbour is that from a wall.
  const auto hold_wall = [&] {
    for (int ty = 0; ty < field.sheet().tiles_y; ++ty) {
      Tile* tile = field.Wake(0, ty);
      for (int j = 0; j < kTile; ++j) {
        const double theta = tile->theta[ThetaIndex(1, j)];
        const double ratio = 0.5 / (material.k_dry * tile->resistance.to_drier[ThetaIndex(1, j)]);
        const double beyond = theta + (kWall_K - theta) * (1 + ratio);
        tile->state.enthalpy[j * kTile] = static_cast<float>(beyond * material.rc_dry);
      }
      field.RefreshTheta(tile, &ledger);
    }
  };
  for (int ty = 0; ty < field.sheet().tiles_y; ++ty) {
    Tile* tile = field.Find(0, ty);
    for (int j = 0; j < kTile; ++j) tile->state.water[j * kTile] = 0;
  }
  field.Diffuse(1e-6f, &ledger);
  const auto steps = static_cast<int>(std::lround(time_s / (0.05 * static_cast<double>(cell_m * cell_m) / 1e-6)));
  for (int n = 0; n < steps; ++n) {
    hold_wall();
    field.Diffuse(static_cast<float>(time_s / steps), &ledger);
  }
  double front = -1;
  for (int tx = 0; tx < field.sheet().tiles_x; ++tx) {
    for (int i = 0; i < kTile; ++i) front += 1 - static_cast<double>(field.Find(tx, 0)->state.water[i]);
  }
  front *= static_cast<double>(cell_m);
  // Depth is 2 l sqrt(alpha_dry t) where the flux out of the dry part less that into the wet one is the latent heat of
  // the front's way.
  const double dry = material.k_dry / material.rc_dry, wet = material.k_wet / material.rc_wet,
               ratio = std::sqrt(dry / wet);
  const double boil = material.theta_boil;
  const auto excess = [&](double l) {
    return material.k_dry * (kWall_K - boil) * std::exp(-l * l) / (std::erf(l) * std::sqrt(kPi * dry)) -
           material.k_wet * boil * std::exp(-l * l * ratio * ratio) / (std::erfc(l * ratio) * std::sqrt(kPi * wet)) -
           static_cast<double>(material.latent) * l * std::sqrt(dry);
  };
  double low = 1e-6, high = 3;
  for (int n = 0; n < 60; ++n) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0 ? low : high) = middle;
  }
  return front / (2 * low * std::sqrt(dry * time_s)) - 1;
}

double TimeOrder() {
  std::vector<std::vector<double>> results;
  for (const float dt : {0.048f, 0.024f, 0.012f}) {
    Variable problem(2e-4f, dt);
    problem.Run(0.48);
    results.push_back(problem.Theta());
  }
  const auto difference = [&](std::size_t a, std::size_t b) {
    double worst = 0;
    for (std::size_t i = 0; i < results[a].size(); ++i) {
      worst = std::max(worst, std::abs(results[a][i] - results[b][i]));
    }
    return worst;
  };
  return std::log2(difference(0, 1) / difference(1, 2));
}

}  // namespace fulcrum::thermal
