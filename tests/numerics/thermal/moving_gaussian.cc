#include "tests/numerics/thermal/moving_gaussian.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {
namespace {

constexpr double kWidth = MovingGaussian::kWidth, kStart = MovingGaussian::kStart, kRow = MovingGaussian::kRow;
constexpr double kDt = MovingGaussian::kDt;
constexpr double kPeak = 50;  ///< About the highest temperature [K]: below boiling, far above the threshold of sleep.

double Source(double x, double y, double tip, double variance) {
  const double dx = x - tip, dy = y - kRow;
  return std::exp(-0.5 * (dx * dx + dy * dy) / variance);
}

/// Adds the source over [t0, t1], by three Gauss points in time.
void AddSource(HeatField* field, const MovingGaussian& problem, double t0, double t1) {
  constexpr double kNode = 0.7745966692414834, kOuter = 5.0 / 18, kInner = 8.0 / 18;
  const double middle = 0.5 * (t0 + t1), half = 0.5 * (t1 - t0);
  const float scale = static_cast<float>(problem.PeakRate() * (t1 - t0)) * field->material().rc_wet;
  const double h = field->material().cell_m;
  std::vector<float> along(kTile), across(kTile);
  Ledger ledger;
  for (Tile* tile : field->awake()) {
    for (const auto& [node, weight] : {std::pair{-kNode, kOuter}, {0.0, kInner}, {kNode, kOuter}}) {
      const double tip = kStart + problem.speed_m_s * (middle + node * half);
      for (int i = 0; i < kTile; ++i) {
        const double dx = (tile->tx * kTile + i + 0.5) * h - tip, dy = (tile->ty * kTile + i + 0.5) * h - kRow;
        along[i] = static_cast<float>(std::exp(-0.5 * dx * dx / (kWidth * kWidth)));
        across[i] = static_cast<float>(weight * std::exp(-0.5 * dy * dy / (kWidth * kWidth)));
      }
      for (int j = 0; j < kTile; ++j) {
        for (int i = 0; i < kTile; ++i) tile->state.enthalpy[j * kTile + i] += scale * across[j] * along[i];
      }
    }
    field->RefreshTheta(tile, &ledger);
  }
}

/// Wakes tiles that the source heats by more than 1e-5 of its peak.
void WakeUnderSource(HeatField* field, double from, double to) {
  constexpr double kReach = 5 * kWidth;
  const double tile = kTile * static_cast<double>(field->material().cell_m);
  for (int ty = static_cast<int>((kRow - kReach) / tile); ty <= static_cast<int>((kRow + kReach) / tile); ++ty) {
    for (int tx = static_cast<int>((from - kReach) / tile); tx <= static_cast<int>((to + kReach) / tile); ++tx) {
      field->Wake(tx, ty);
    }
  }
}

}  // namespace

int MovingGaussian::frames() const { return static_cast<int>(std::lround(kWay / (speed_m_s * kDt))); }

double MovingGaussian::PeakRate() const { return kPeak * speed_m_s / (std::sqrt(2 * std::numbers::pi) * kWidth); }

double MovingGaussian::Rate(double x, double y, double time_s) const {
  return PeakRate() * Source(x, y, kStart + speed_m_s * time_s, kWidth * kWidth);
}

double MovingGaussian::Exact(double x, double y, double time_s) const {
  constexpr int kPieces = 800;
  double sum = 0;
  for (int n = 0; n <= kPieces; ++n) {
    const double t = time_s * n / kPieces;
    const double variance = kWidth * kWidth + 2 * diffusivity_m2_s * (time_s - t);
    const double weight = n == 0 || n == kPieces ? 1 : (n % 2 == 1 ? 4 : 2);
    sum += weight * PeakRate() * kWidth * kWidth / variance * Source(x, y, kStart + speed_m_s * t, variance);
  }
  return sum * time_s / kPieces / 3;
}

MovingGaussianResult RunMovingGaussian(float cell_m, double speed_m_s) {
  ThermalParams params;
  params.cell_m = cell_m;
  params.h_top_W_m2K = params.h_below_W_m2K = params.h_tented_W_m2K = params.perfusion_per_s = 0;
  constexpr auto kSide = static_cast<float>(MovingGaussian::kWindow);
  HeatField field(MakeFlatSheet(kSide, kSide, cell_m), MakeMaterial(params));
  const MovingGaussian problem{
      .speed_m_s = speed_m_s,
      .diffusivity_m2_s = static_cast<double>(field.material().k_wet / field.material().rc_wet)};
  const Sheet& sheet = field.sheet();
  MovingGaussianResult result;
  Ledger ledger;
  std::vector<double> times;
  const int frames = problem.frames();
  for (int frame = 0; frame < frames; ++frame) {
    const double t = frame * kDt;
    WakeUnderSource(&field, kStart + speed_m_s * t, kStart + speed_m_s * (t + kDt));
    AddSource(&field, problem, t, t + 0.5 * kDt);
    const auto start = std::chrono::steady_clock::now();
    field.Diffuse(static_cast<float>(kDt), &ledger);
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    AddSource(&field, problem, t + 0.5 * kDt, t + kDt);
  }
  result.tiles = static_cast<int>(field.awake().size());
  std::nth_element(times.begin(), times.begin() + frames / 2, times.end());
  result.step_ms = times[static_cast<std::size_t>(frames / 2)];
  double highest = 0, worst = 0;
  for (const Tile* tile : field.awake()) {
    for (int k = 0; k < kTileCells; ++k) {
      const CellIndex cell{tile->tx * kTile + k % kTile, tile->ty * kTile + k / kTile};
      if (!sheet.Contains(cell)) continue;
      const Vec2f p = sheet.CentreOf(cell);
      const double exact = problem.Exact(p.x(), p.y(), frames * kDt);
      highest = std::max(highest, exact);
      worst = std::max(worst, std::abs(exact - tile->theta[ThetaIndex(k % kTile, k / kTile)]));
    }
  }
  result.max_error = worst / highest;
  return result;
}

}  // namespace fulcrum::thermal
