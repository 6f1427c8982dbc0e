// Damage of the volume; temperature and burn depth at a place.
#include <algorithm>
#include <cmath>

#include "thermal_node/volume/brick_kernels.h"
#include "thermal_node/volume/volume_field.h"

namespace fulcrum::thermal {

void VolumeField::Damage(Brick* brick, float dt_s) {
  if (brick->theta_max < kDamageStart) return;
  const WarmBox& box = brick->box;
  bool deepest = true;  // layers above the deepest dead one need not be checked
  for (int k = box.layers - 1; k >= 0; --k) {
    bool dead = false;
    for (int j = box.row0; j < box.row1; ++j) {
      if (brick->pair_max[k * kBrickPairs + j / kBoxRows] < kDamageStart) continue;
      float* omega = &brick->omega[BrickIndex(box.col0, j, k)];
      const int count = box.col1 - box.col0;
      const float* theta = &brick->theta[BrickThetaIndex(box.col0, j, k)];
      if (!DamageRow(theta, omega, count, cell_death_, dt_s) || !deepest) continue;
      dead = true;
      for (int i = 0; i < count; ++i) {
        if (omega[i] >= 1.0f) deepest_burn_m_ = std::max(deepest_burn_m_, BurnDepth(*brick, j * kBrick + box.col0 + i));
      }
    }
    deepest = deepest && !dead;
  }
}

float VolumeField::ThetaAt(const Vec2f& material, float depth_m) const {
  const CellIndex cell = sheet_.CellOf(material);
  if (!sheet_.Contains(cell)) return 0;
  const Brick* brick = Find(cell.ix / kBrickSpan, cell.iy / kBrickSpan);
  if (brick == nullptr || !brick->awake) return 0;
  const int i = cell.ix % kBrickSpan * 2 / 3, j = cell.iy % kBrickSpan * 2 / 3;
  const float z = std::clamp(depth_m / material_.pitch_m - 0.5f, 0.0f, static_cast<float>(kLayers - 1));
  const int k = std::min(static_cast<int>(z), kLayers - 2);
  const float f = z - static_cast<float>(k);
  if (!brick->box.Holds(i, j, 0)) return 0;
  const float upper = brick->theta[BrickThetaIndex(i, j, k)], lower = brick->theta[BrickThetaIndex(i, j, k + 1)];
  return upper + f * (lower - upper);
}

float VolumeField::BurnDepth(const Brick& brick, int column) const {
  const auto omega = [&](int k) { return brick.omega[k * kColumns + column]; };
  int k = kLayers - 1;
  while (k >= 0 && omega(k) < 1.0f) --k;
  if (k < 0) return 0;
  if (k == kLayers - 1) return material_.depth_m();
  // Omega falls by decades from layer to layer, so its logarithm is interpolated linearly.
  constexpr float kLeast = 1e-6f;
  const float here = std::log(omega(k)), next = std::log(std::max(omega(k + 1), kLeast));
  return (static_cast<float>(k) + 0.5f + here / (here - next)) * material_.pitch_m;
}

float VolumeField::BurnDepth(const Vec2f& material) const {
  const CellIndex cell = sheet_.CellOf(material);
  if (!sheet_.Contains(cell)) return 0;
  const Brick* brick = Find(cell.ix / kBrickSpan, cell.iy / kBrickSpan);
  if (brick == nullptr) return 0;
  return BurnDepth(*brick, cell.iy % kBrickSpan * 2 / 3 * kBrick + cell.ix % kBrickSpan * 2 / 3);
}

}  // namespace fulcrum::thermal
