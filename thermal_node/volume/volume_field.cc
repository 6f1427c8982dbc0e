#include "thermal_node/volume/volume_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "thermal_node/heat/heat_field.h"
#include "thermal_node/volume/brick_kernels.h"

namespace fulcrum::thermal {
namespace {

/// Rows and layers a box grows by at once, so that it does not grow at every step.
constexpr int kGrowRows = 2, kGrowLayers = 1;
/// Less heat than this does not wake tissue [K/s]: what a tip that moves on leaves there is less than a sleeping brick
/// may hold.
constexpr float kLeastSource_K_s = 1.0f;
constexpr double kGas_J_molK = 8.314462618;
constexpr double kZero_C = 273.15;
/// Fractions of one sheet cell over the columns 2n and 2n + 1 that lie below the cells 3n, 3n + 1, 3n + 2.
constexpr float kOverlap[3][2] = {{1.0f, 0.0f}, {0.5f, 0.5f}, {0.0f, 1.0f}};

CellMetric MeanMetric(const Sheet& sheet, int bx, int by, float* largest_area) {
  CellMetric mean{0, 0};
  float count = 0;
  *largest_area = 0;
  for (int ty = kBrickTiles * by; ty < std::min(kBrickTiles * (by + 1), sheet.tiles_y); ++ty) {
    for (int tx = kBrickTiles * bx; tx < std::min(kBrickTiles * (bx + 1), sheet.tiles_x); ++tx, ++count) {
      const CellMetric m = sheet.metric[ty * sheet.tiles_x + tx];
      mean.s += m.s;
      mean.t += m.t;
      *largest_area = std::max(*largest_area, m.s * m.t);
    }
  }
  return {mean.s / count, mean.t / count};
}

}  // namespace

bool IsBlank(const Brick& brick) {
  return !brick.awake && std::all_of(brick.omega.begin(), brick.omega.end(), [](float o) { return o == 0.0f; });
}

VolumeField::VolumeField(const Sheet& sheet, const ThermalParams& params)
    : sheet_(sheet),
      material_(MakeVolumeMaterial(params)),
      damage_a_(static_cast<float>(std::log2(kCellDeath.a_per_s))),
      damage_b_(static_cast<float>(kCellDeath.ea_J_mol / (kGas_J_molK * std::log(2.0)))),
      damage_zero_K_(static_cast<float>(kZero_C) + params.body_temperature_C),
      bricks_x_((sheet.tiles_x + kBrickTiles - 1) / kBrickTiles),
      bricks_y_((sheet.tiles_y + kBrickTiles - 1) / kBrickTiles),
      bricks_(static_cast<std::size_t>(bricks_x_) * bricks_y_) {}

Brick* VolumeField::Find(int bx, int by) const {
  if (bx < 0 || by < 0 || bx >= bricks_x_ || by >= bricks_y_) return nullptr;
  return bricks_[by * bricks_x_ + bx].get();
}

Brick* VolumeField::Create(int index) {
  auto brick = std::make_unique<Brick>();
  brick->index = index;
  brick->bx = index % bricks_x_;
  brick->by = index / bricks_x_;
  float largest = 1;
  const CellMetric metric = MeanMetric(sheet_, brick->bx, brick->by, &largest);
  brick->length_s = metric.s;
  brick->length_t = metric.t;
  brick->volume = material_.pitch_m * material_.pitch_m * material_.pitch_m * metric.s * metric.t;
  brick->lid_area = largest / (metric.s * metric.t);
  bricks_[index] = std::move(brick);
  return bricks_[index].get();
}

void VolumeField::Rouse(Brick* brick) {
  if (brick->awake) return;
  brick->awake = true;
  const auto before = std::lower_bound(awake_.begin(), awake_.end(), brick->index,
                                       [](const Brick* b, int wanted) { return b->index < wanted; });
  awake_.insert(before, brick);
}

Brick* VolumeField::Wake(int bx, int by, int row0, int row1, int layers) {
  if (bx < 0 || by < 0 || bx >= bricks_x_ || by >= bricks_y_) return nullptr;
  const int index = by * bricks_x_ + bx;
  Brick* brick = bricks_[index] ? bricks_[index].get() : Create(index);
  Rouse(brick);
  WarmBox& box = brick->box;
  box.row0 = std::max(0, std::min(box.row0, row0 & ~1));
  box.row1 = std::min(kBrick, std::max(box.row1, (row1 + 1) & ~1));
  box.layers = std::min(kLayers, std::max(box.layers, layers));
  return brick;
}

void VolumeField::AddSource(CellIndex cell, float heat_J_m3, float duration_s) {
  const int bx = cell.ix / kBrickSpan, by = cell.iy / kBrickSpan;
  const int x = cell.ix % kBrickSpan, y = cell.iy % kBrickSpan;
  const int i = x / 3 * 2, j = y / 3 * 2, deepest = material_.fat_layers - 1;
  Brick* brick = Find(bx, by);
  if (brick == nullptr || !brick->box.Holds(j, deepest) || !brick->box.Holds(j + 1, deepest)) {
    if (heat_J_m3 < kLeastSource_K_s * duration_s * material_.rc[0]) return;
    brick = Wake(bx, by, j, j + 2, material_.fat_layers);
  }
  const float share = heat_J_m3 / (kPitch * kPitch);
  for (int dj = 0; dj < 2; ++dj) {
    for (int di = 0; di < 2; ++di) {
      brick->source[(j + dj) * kBrick + i + di] += share * kOverlap[x % 3][di] * kOverlap[y % 3][dj];
    }
  }
  ledger_.joule += static_cast<double>(share) * brick->volume * material_.fat_layers;
  brick->has_source = true;
}

float VolumeField::Rate() const {
  float rate = 0;
  const float p2 = material_.pitch_m * material_.pitch_m;
  for (const Brick* brick : awake_) {
    const float faces_s = 1.0f + std::max({1.0f, BorderWeight(*brick, -1, 0), BorderWeight(*brick, 1, 0)});
    const float faces_t = 1.0f + std::max({1.0f, BorderWeight(*brick, 0, -1), BorderWeight(*brick, 0, 1)});
    const float flat = faces_s / (brick->length_s * brick->length_s) + faces_t / (brick->length_t * brick->length_t);
    for (int k = 0; k < brick->box.layers; ++k) {
      const float lid = k == 0 ? material_.face[0] * brick->lid_area : 0.0f;
      const float above = k == 0 ? 0.0f : material_.face[k];
      const float steep = (above + material_.face[k + 1] + lid) / material_.pitch_m + material_.perfusion;
      rate = std::max(rate, (flat * material_.k[k] / p2 + steep) / material_.rc[k]);
    }
  }
  return rate;
}

void VolumeField::Spread() {
  scratch_.assign(awake_.begin(), awake_.end());
  for (Brick* brick : scratch_) {
    WarmBox& box = brick->box;
    if (box.empty()) continue;
    bool first = false, last = false, left = false, right = false;
    for (int k = 0; k < box.layers; ++k) {
      const float* high = &brick->pair_max[k * kBrickPairs];
      first = first || high[box.row0 / 2] > kVolumeWakeTheta;
      last = last || high[box.row1 / 2 - 1] > kVolumeWakeTheta;
      for (int j = box.row0; j < box.row1 && !(left && right); ++j) {
        if (high[j / 2] <= kVolumeWakeTheta) continue;
        left = left || brick->theta[BrickThetaIndex(0, j, k)] > kVolumeWakeTheta;
        right = right || brick->theta[BrickThetaIndex(kBrick - 1, j, k)] > kVolumeWakeTheta;
      }
    }
    const auto hold = [&](int bx, int by, int row0, int row1) {
      if (Brick* other = Wake(bx, by, row0, row1, box.layers)) other->held = true;
    };
    if (left) hold(brick->bx - 1, brick->by, box.row0, box.row1);
    if (right) hold(brick->bx + 1, brick->by, box.row0, box.row1);
    if (first && box.row0 == 0) hold(brick->bx, brick->by - 1, kBrick - kGrowRows, kBrick);
    if (last && box.row1 == kBrick) hold(brick->bx, brick->by + 1, 0, kGrowRows);
    if (first) box.row0 = std::max(0, box.row0 - kGrowRows);
    if (last) box.row1 = std::min(kBrick, box.row1 + kGrowRows);
    if (box.layers > 0 && box.layers < kLayers) {
      const float* high = &brick->pair_max[(box.layers - 1) * kBrickPairs];
      if (*std::max_element(high + box.row0 / 2, high + box.row1 / 2) > kVolumeWakeTheta) box.layers += kGrowLayers;
    }
  }
}

/// Conductance of a face to a neighbour over that of a face inside; 0: no neighbour awake. Rest lengths count by their
/// harmonic mean, so that it is less than 2.
float VolumeField::BorderWeight(const Brick& brick, int dx, int dy) const {
  const Brick* other = Find(brick.bx + dx, brick.by + dy);
  if (other == nullptr || !other->awake) return 0;
  const auto ratio = [&](const Brick& b) { return dx != 0 ? b.length_t / b.length_s : b.length_s / b.length_t; };
  return 2.0f * ratio(*other) / (ratio(brick) + ratio(*other));
}

/// The value beyond a face is set so that the conductance inside gives the flux of the border. Where either side's box
/// ends it is the cell's own value: no heat crosses.
void VolumeField::FillHalos(Brick* brick) const {
  float* theta = brick->theta.data();
  const WarmBox& box = brick->box;
  for (const int dx : {-1, 1}) {
    const Brick* other = Find(brick->bx + dx, brick->by);
    const float weight = BorderWeight(*brick, dx, 0);
    const int inside = dx < 0 ? 0 : kBrick - 1, beyond = kBrick - 1 - inside;
    for (int k = 0; k < box.layers; ++k) {
      for (int j = box.row0; j < box.row1; ++j) {
        const int at = BrickThetaIndex(inside, j, k);
        const bool joined = weight > 0.0f && other->box.Holds(j, k);
        const float theirs = joined ? other->theta[BrickThetaIndex(beyond, j, k)] : theta[at];
        theta[at + dx] = theta[at] + weight * (theirs - theta[at]);
      }
    }
  }
  for (const int dy : {-1, 1}) {
    const Brick* other = Find(brick->bx, brick->by + dy);
    const float weight = BorderWeight(*brick, 0, dy);
    const int inside = dy < 0 ? 0 : kBrick - 1, beyond = kBrick - 1 - inside;
    for (int k = 0; k < box.layers && box.Holds(inside, k); ++k) {
      const float* own = &theta[BrickThetaIndex(0, inside, k)];
      float* halo = &theta[BrickThetaIndex(0, inside + dy, k)];
      const bool joined = weight > 0.0f && other->box.Holds(beyond, k);
      const float* theirs = joined ? &other->theta[BrickThetaIndex(0, beyond, k)] : own;
      for (int i = 0; i < kBrick; ++i) halo[i] = own[i] + weight * (theirs[i] - own[i]);
    }
  }
}

void VolumeField::StepBrick(Brick* brick, float dt_s) {
  const float p = material_.pitch_m;
  const WarmBox& box = brick->box;
  for (int k = 0; k < box.layers; ++k) {
    ledger_.perfused += static_cast<double>(brick->layer_sum[k]) * dt_s * material_.perfusion * brick->volume;
    const float per_rc = dt_s / material_.rc[k];
    LayerStep step;
    step.along_s = per_rc * material_.k[k] / (p * p * brick->length_s * brick->length_s);
    step.along_t = per_rc * material_.k[k] / (p * p * brick->length_t * brick->length_t);
    step.above = k == 0 ? 0.0f : per_rc * material_.face[k] / p;
    step.below = k + 1 < box.layers ? per_rc * material_.face[k + 1] / p : 0.0f;
    step.loss = per_rc * material_.perfusion;
    step.source = brick->has_source && k < material_.fat_layers ? 1.0f / material_.rc[k] : 0.0f;
    ConductLayer(brick, k, step);
    if (k == 0) lid_sum_ += ApplyLid(brick, dt_s) * material_.rc[0] * brick->volume;
    // The layer above is no longer read.
    if (k > 0) RefreshLayer(brick, k - 1, material_.theta_boil, material_.latent[k - 1]);
  }
  if (box.layers > 0) RefreshLayer(brick, box.layers - 1, material_.theta_boil, material_.latent[box.layers - 1]);
  if (brick->has_source) {
    std::fill(brick->source.begin() + box.row0 * kBrick, brick->source.begin() + box.row1 * kBrick, 0.0f);
    brick->has_source = false;
  }
  Quarantine(brick);
}

double VolumeField::Advance(float dt_s) {
  for (Brick* brick : awake_) FillHalos(brick);
  lid_sum_ = 0;
  for (Brick* brick : awake_) StepBrick(brick, dt_s);
  ledger_.from_sheet += lid_sum_;
  return lid_sum_;
}

void VolumeField::RefreshBrick(Brick* brick) {
  for (int k = 0; k < brick->box.layers; ++k) RefreshLayer(brick, k, material_.theta_boil, material_.latent[k]);
}

/// A bad cell starts again from body temperature before any neighbour has read it.
void VolumeField::Quarantine(Brick* brick) {
  const WarmBox& box = brick->box;
  float high = 0;
  bool bad = false;
  for (int k = 0; k < box.layers; ++k) {
    for (int j = box.row0; j < box.row1; j += 2) high = std::max(high, brick->pair_max[k * kBrickPairs + j / 2]);
    bad = bad || !std::isfinite(brick->layer_sum[k]);  // a maximum does not see NaN
  }
  brick->theta_max = high;
  if (!bad && high <= kThetaPlausible) return;
  for (int k = 0; k < box.layers; ++k) {
    for (int j = box.row0; j < box.row1; ++j) {
      for (int i = 0; i < kBrick; ++i) {
        float& h = brick->enthalpy[BrickIndex(i, j, k)];
        if (std::abs(brick->theta[BrickThetaIndex(i, j, k)]) <= kThetaPlausible) continue;
        if (std::isfinite(h)) ledger_.quarantined += static_cast<double>(h) * material_.rc[k] * brick->volume;
        h = 0;
        ++quarantined_;
      }
    }
  }
  RefreshBrick(brick);
  Quarantine(brick);  // all cells are plausible now
}

void VolumeField::Finish(float dt_s) {
  for (Brick* brick : awake_) Damage(brick, dt_s);
  SleepCold();
}

void VolumeField::SleepCold() {
  const auto cold = [&](Brick* brick) {
    const bool held = std::exchange(brick->held, false);
    if (held || brick->has_source || brick->theta_max >= kVolumeSleepTheta) return false;
    ledger_.dropped += StoredIn(*brick);
    brick->enthalpy.fill(0);
    brick->theta.fill(0);
    brick->pair_max.fill(0);
    brick->layer_sum.fill(0);
    brick->theta_max = 0;
    brick->box = {};
    brick->awake = false;
    return true;
  };
  std::erase_if(awake_, cold);
}

float VolumeField::MaxTheta() const {
  float high = 0;
  for (const Brick* brick : awake_) high = std::max(high, brick->theta_max);
  return high;
}

double VolumeField::StoredIn(const Brick& brick) const {
  double total = 0;
  for (int k = 0; k < brick.box.layers; ++k) {
    double heat = 0;
    for (int j = brick.box.row0; j < brick.box.row1; ++j) {
      for (int i = 0; i < kBrick; ++i) heat += brick.enthalpy[BrickIndex(i, j, k)];
    }
    total += heat * material_.rc[k] * brick.volume;
  }
  return total;
}

double VolumeField::Stored() const {
  double total = 0;
  for (const Brick* brick : awake_) total += StoredIn(*brick);
  return total;
}

void VolumeField::AddSums(Hash64* hash) const {
  for (const Brick* brick : awake_) {
    hash->AddValue(brick->index);
    hash->Add(std::span<const float>(brick->layer_sum));
  }
  hash->AddValue(ledger_.joule);
  hash->AddValue(ledger_.perfused);
  hash->AddValue(deepest_burn_m_);
}

std::vector<const Brick*> VolumeField::Existing() const {
  std::vector<const Brick*> all;
  for (const auto& brick : bricks_) {
    if (brick && !IsBlank(*brick)) all.push_back(brick.get());
  }
  return all;
}

VolumeField::Totals VolumeField::totals() const { return {ledger_, quarantined_, deepest_burn_m_}; }

void VolumeField::RestoreTotals(const Totals& totals) {
  ledger_ = totals.ledger;
  quarantined_ = totals.quarantined;
  deepest_burn_m_ = totals.deepest_burn_m;
}

Brick* VolumeField::BeginRestore(int index) { return Create(index); }

void VolumeField::FinishRestore(Brick* brick) {
  if (!std::exchange(brick->awake, false)) return;
  Rouse(brick);
  RefreshBrick(brick);
  Quarantine(brick);
}

void VolumeField::Clear() {
  awake_.clear();
  for (auto& brick : bricks_) brick.reset();
}

}  // namespace fulcrum::thermal
