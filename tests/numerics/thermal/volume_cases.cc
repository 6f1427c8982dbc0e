#include "tests/numerics/thermal/volume_cases.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

namespace fulcrum::thermal {
namespace {

constexpr double kAlphaFat = 0.21 / (911.0 * 2348.0);

int Steps(double duration_s, double pitch_m) {
  const double dt = 0.1 * pitch_m * pitch_m / kAlphaFat;  // 0.6 of the explicit limit
  return static_cast<int>(std::ceil(duration_s / dt));
}

template <class Visit>
void ForCells(const VolumeField& volume, const Visit& visit) {
  for (const Brick* brick : volume.awake()) {
    for (int k = 0; k < kLayers; ++k) {
      for (int j = 0; j < kBrick; ++j) {
        for (int i = 0; i < kBrick; ++i) visit(*brick, brick->bx * kBrick + i, brick->by * kBrick + j, k, i, j);
      }
    }
  }
}

double MedianMs(std::vector<double> times) {
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

}  // namespace

ThermalParams PlainFat(float cell_m) {
  ThermalParams params;
  params.cell_m = cell_m;
  params.perfusion_per_s = 0;
  params.fat_depth_m = 0.1f;
  params.volume = 1;
  return params;
}

Sheet SheetOfBricks(int bricks_x, int bricks_y, float cell_m) {
  return MakeFlatSheet(static_cast<float>(bricks_x * kBrickSpan) * cell_m,
                       static_cast<float>(bricks_y * kBrickSpan) * cell_m, cell_m);
}

double HalfSpaceError(float pitch_m) {
  constexpr double kSurface = 40, kDuration_s = 8;
  const Sheet sheet = SheetOfBricks(1, 1, pitch_m / kPitch);
  VolumeField volume(sheet, PlainFat(pitch_m / kPitch));
  Brick* brick = volume.Wake(0, 0, kWholeBrick);
  const float rate = volume.material().face[0] / (volume.material().rc[0] * volume.material().pitch_m);
  brick->lid_rate.fill(rate);
  brick->lid_flux.fill(rate * static_cast<float>(kSurface));
  const int steps = Steps(kDuration_s, pitch_m);
  for (int n = 0; n < steps; ++n) volume.Advance(static_cast<float>(kDuration_s / steps));
  double error = 0;
  for (int k = 0; k < kLayers; ++k) {
    const double z = (k + 0.5) * volume.material().pitch_m;
    const double exact = kSurface * std::erfc(z / (2 * std::sqrt(kAlphaFat * kDuration_s)));
    error = std::max(error, std::abs(brick->theta[BrickThetaIndex(20, 30, k)] - exact));
  }
  return error / kSurface;
}

double SheetOnFatError(float cell_m) {
  constexpr float kStart_C = 40, kFrame_s = 0.01f;
  ThermalParams params = PlainFat(cell_m);
  params.h_top_W_m2K = params.h_below_W_m2K = 0;
  params.conductivity_W_mK = 2;  // the layer of the formula has no thermal resistance
  const Material material = MakeMaterial(params);
  HeatField field(SheetOfBricks(1, 1, cell_m), material);
  VolumeField volume(field.sheet(), params);
  const SheetContact contact(material, volume.material());
  Ledger ledger;
  for (int ty = 0; ty < kBrickTiles; ++ty) {
    for (int tx = 0; tx < kBrickTiles; ++tx) {
      Tile* tile = field.Wake(tx, ty);
      tile->state.enthalpy.fill(material.rc_wet * kStart_C);
      field.RefreshTheta(tile, &ledger);
    }
  }
  const Tissue fat = kFat;
  const double b = std::sqrt(fat.conductivity_W_mK * fat.density_kg_m3 * fat.heat_capacity_J_kgK) /
                   (material.rc_wet * material.thickness_m);
  double error = 0;
  for (int n = 1; n <= 400; ++n) {
    contact.Step(kFrame_s, &field, &volume, &ledger);
    const double t = n * kFrame_s;
    if (n < 100) continue;
    const double exact = std::exp(b * b * t) * std::erfc(b * std::sqrt(t));
    error = std::max(error, std::abs(field.MaxTheta() / kStart_C - exact));
  }
  return error;
}

double CosineError(int half_waves) {
  constexpr double kAmplitude = 20;
  constexpr float kPitch_m = 1.5e-4f;
  const Sheet sheet = SheetOfBricks(2, 1, kPitch_m / kPitch);
  VolumeField volume(sheet, PlainFat(kPitch_m / kPitch));
  for (int bx = 0; bx < 2; ++bx) volume.Wake(bx, 0, kWholeBrick);
  const double pi_w = std::numbers::pi * half_waves, p = kPitch_m;
  const double ws = 2 * pi_w / (2 * kBrick * p), wt = pi_w / (kBrick * p), wz = pi_w / (kLayers * p);
  const auto shape = [&](int x, int y, int k) {
    return std::cos(ws * (x + 0.5) * p) * std::cos(wt * (y + 0.5) * p) * std::cos(wz * (k + 0.5) * p);
  };
  ForCells(volume, [&](const Brick& brick, int x, int y, int k, int i, int j) {
    const auto start = static_cast<float>(kAmplitude * (1 + shape(x, y, k)));
    volume.Find(brick.bx, brick.by)->enthalpy[BrickIndex(i, j, k)] = start;
  });
  volume.Advance(0);  // theta from the enthalpy
  const double duration_s = 1.0 / (kAlphaFat * (ws * ws + wt * wt + wz * wz));
  const int steps = Steps(duration_s, p);
  for (int n = 0; n < steps; ++n) volume.Advance(static_cast<float>(duration_s / steps));
  double error = 0;
  ForCells(volume, [&](const Brick& brick, int x, int y, int k, int i, int j) {
    const double exact = kAmplitude * (1 + std::exp(-1.0) * shape(x, y, k));
    error = std::max(error, std::abs(brick.theta[BrickThetaIndex(i, j, k)] - exact));
  });
  return error / kAmplitude;
}

VolumeTimes TimeVolume() {
  using Clock = std::chrono::steady_clock;
  constexpr float kFrame_s = 0.01f;
  constexpr int kRuns = 101;
  const ThermalParams params;
  const auto time = [&](bool contact, float floor_K) {
    ThermalParams lower = params;
    lower.h_below_W_m2K = 0;
    const Material material = MakeMaterial(lower);
    HeatField field(SheetOfBricks(1, 1, params.cell_m), material);
    VolumeField volume(field.sheet(), params);
    const SheetContact between(material, volume.material());
    Ledger ledger;
    Brick* brick = volume.Wake(0, 0, kWholeBrick);
    ForCells(volume, [&](const Brick&, int, int, int k, int i, int j) {
      const float x = (static_cast<float>(i) - 31.5f) * 0.15f, y = (static_cast<float>(j) - 31.5f) * 0.15f;
      const float z = (static_cast<float>(k) + 0.5f) * 0.15f;
      brick->enthalpy[BrickIndex(i, j, k)] = floor_K + 55.0f * std::exp(-(x * x + y * y + z * z) / 3.0f);
    });
    for (int ty = 0; contact && ty < kBrickTiles; ++ty) {
      for (int tx = 0; tx < kBrickTiles; ++tx) {
        Tile* tile = field.Wake(tx, ty);
        tile->state.enthalpy.fill(material.rc_wet * 10.0f);
        field.RefreshTheta(tile, &ledger);
      }
    }
    volume.Advance(0);
    std::vector<double> times;
    for (int n = 0; n < kRuns; ++n) {
      brick->has_source = true;
      const auto start = Clock::now();
      if (contact) {
        between.Step(kFrame_s, &field, &volume, &ledger);
      } else {
        volume.Spread();
        volume.Advance(kFrame_s);
        volume.Finish(kFrame_s);
      }
      times.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    }
    return MedianMs(times);
  };
  return {time(false, 0.5f), time(false, 8.0f), time(true, 0.5f)};
}

}  // namespace fulcrum::thermal
