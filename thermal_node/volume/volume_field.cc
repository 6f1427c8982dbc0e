#include "thermal_node/volume/volume_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "thermal_node/heat/heat_field.h"
#include "thermal_node/volume/brick_kernels.h"

namespace fulcrum::thermal {
namespace {

/// Rate of heating below which sleeping tissue is not woken [K/s]: a moving tip deposits less heat there than a
/// sleeping brick may discard.
constexpr float kLeastSource_K_s = 1.0f;
/// Fractions of the sheet cells 3n, 3n + 1 and 3n + 2 (rows) that lie above the columns 2n and 2n + 1.
constexpr float kOverlap[3][2] = {{1.0f, 0.0f}, {0.5f, 0.5f}, {0.0f, 1.0f}};

/// Mean stretch of the sheet above a brick along s and t, and the largest rest area of a cell over its material area.
Vec2f MeanStretch(const Sheet& sheet, int bx, int by, float* largest_area) {
  Vec2f sum = Vec2f::Zero();
  float count = 0;
  *largest_area = 0;
  for (int y = 0; y <= kBrickSpan; y += kMetricStep) {
    for (int x = 0; x <= kBrickSpan; x += kMetricStep, ++count) {
      const SurfaceMetric g =
          sheet.MetricAt(static_cast<float>(bx * kBrickSpan + x), static_cast<float>(by * kBrickSpan + y));
      sum += Vec2f(std::sqrt(g.ss), std::sqrt(g.tt));
      *largest_area = std::max(*largest_area, g.area());
    }
  }
  return sum / count;
}

}  // namespace

bool IsBlank(const Brick& brick) {
  return !brick.awake && std::all_of(brick.omega.begin(), brick.omega.end(), [](float o) { return o == 0.0f; });
}

VolumeField::VolumeField(const Sheet& sheet, const ThermalParams& params)
    : sheet_(sheet),
      material_(MakeVolumeMaterial(params)),
      cell_death_(kCellDeath, params.body_temperature_C),
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
  const Vec2f stretch = MeanStretch(sheet_, brick->bx, brick->by, &largest);
  brick->length_s = stretch.x();
  brick->length_t = stretch.y();
  brick->volume = material_.pitch_m * material_.pitch_m * material_.pitch_m * stretch.x() * stretch.y();
  brick->lid_area = largest / (stretch.x() * stretch.y());
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

Brick* VolumeField::Wake(int bx, int by, const WarmBox& need) {
  if (bx < 0 || by < 0 || bx >= bricks_x_ || by >= bricks_y_) return nullptr;
  const int index = by * bricks_x_ + bx;
  Brick* brick = bricks_[index] ? bricks_[index].get() : Create(index);
  Rouse(brick);
  Grow(brick, need);
  return brick;
}

void VolumeField::Grow(Brick* brick, const WarmBox& need) {
  const WarmBox before = brick->box;
  const auto down = [](int value, int step) { return std::max(0, value) / step * step; };
  const auto up = [](int value, int step) { return std::min(kBrick, (value + step - 1) / step * step); };
  WarmBox& box = brick->box;
  box.col0 = std::min(before.col0, down(need.col0, kBoxColumns));
  box.col1 = std::max(before.col1, up(need.col1, kBoxColumns));
  box.row0 = std::min(before.row0, down(need.row0, kBoxRows));
  box.row1 = std::max(before.row1, up(need.row1, kBoxRows));
  box.layers = std::min(kLayers, std::max(before.layers, need.layers));
  if (before.empty() || (box.col0 == before.col0 && box.col1 == before.col1)) return;
  // The cells beside the old box held halo values.
  for (int k = 0; k < before.layers; ++k) {
    for (int j = before.row0; j < before.row1; ++j) {
      if (box.col0 < before.col0) brick->theta[BrickThetaIndex(before.col0 - 1, j, k)] = 0;
      if (box.col1 > before.col1) brick->theta[BrickThetaIndex(before.col1, j, k)] = 0;
    }
  }
}

void VolumeField::AddSource(CellIndex cell, float heat_J_m3, float duration_s) {
  const int bx = cell.ix / kBrickSpan, by = cell.iy / kBrickSpan;
  const int x = cell.ix % kBrickSpan, y = cell.iy % kBrickSpan;
  const int i = x / 3 * 2, j = y / 3 * 2, deepest = material_.fat_layers - 1;
  Brick* brick = Find(bx, by);
  // Boxes have even borders, so the next row and column are inside as well.
  if (brick == nullptr || !brick->box.Holds(i, j, deepest)) {
    if (heat_J_m3 < kLeastSource_K_s * duration_s * material_.rc[0]) return;
    brick = Wake(bx, by, {i, i + 2, j, j + 2, material_.fat_layers});
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
    const WarmBox box = brick->box;
    if (box.empty()) continue;
    bool first = false, last = false, left = false, right = false;
    for (int k = 0; k < box.layers; ++k) {
      const float* high = &brick->pair_max[k * kBrickPairs];
      first = first || high[box.row0 / kBoxRows] > kVolumeWakeTheta;
      last = last || high[box.row1 / kBoxRows - 1] > kVolumeWakeTheta;
      for (int j = box.row0; j < box.row1 && !(left && right); ++j) {
        if (high[j / kBoxRows] <= kVolumeWakeTheta) continue;
        left = left || brick->theta[BrickThetaIndex(box.col0, j, k)] > kVolumeWakeTheta;
        right = right || brick->theta[BrickThetaIndex(box.col1 - 1, j, k)] > kVolumeWakeTheta;
      }
    }
    const float* lowest = &brick->pair_max[(box.layers - 1) * kBrickPairs];
    const bool deep = *std::max_element(lowest + box.row0 / kBoxRows, lowest + box.row1 / kBoxRows) > kVolumeWakeTheta;
    const auto hold = [&](int dx, int dy, WarmBox need) {
      if (Brick* other = Wake(brick->bx + dx, brick->by + dy, need)) other->held = true;
    };
    WarmBox need = box;
    if (left && box.col0 == 0) hold(-1, 0, {kBrick - 1, kBrick, box.row0, box.row1, box.layers});
    if (right && box.col1 == kBrick) hold(1, 0, {0, 1, box.row0, box.row1, box.layers});
    if (first && box.row0 == 0) hold(0, -1, {box.col0, box.col1, kBrick - 1, kBrick, box.layers});
    if (last && box.row1 == kBrick) hold(0, 1, {box.col0, box.col1, 0, 1, box.layers});
    need.col0 -= left ? 1 : 0;
    need.col1 += right ? 1 : 0;
    need.row0 -= first ? 1 : 0;
    need.row1 += last ? 1 : 0;
    need.layers += deep ? 1 : 0;
    Grow(brick, need);
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
    const int inside = dx < 0 ? box.col0 : box.col1 - 1, beyond = dx < 0 ? kBrick - 1 : 0;
    const bool at_border = inside + dx < 0 || inside + dx == kBrick;
    const Brick* other = Find(brick->bx + dx, brick->by);
    const float weight = at_border ? BorderWeight(*brick, dx, 0) : 0.0f;
    for (int k = 0; k < box.layers; ++k) {
      for (int j = box.row0; j < box.row1; ++j) {
        const int at = BrickThetaIndex(inside, j, k);
        const bool joined = weight > 0.0f && other->box.Holds(beyond, j, k);
        const float theirs = joined ? other->theta[BrickThetaIndex(beyond, j, k)] : theta[at];
        theta[at + dx] = theta[at] + weight * (theirs - theta[at]);
      }
    }
  }
  for (const int dy : {-1, 1}) {
    const int inside = dy < 0 ? 0 : kBrick - 1, beyond = kBrick - 1 - inside;
    if (inside < box.row0 || inside >= box.row1) continue;
    const Brick* other = Find(brick->bx, brick->by + dy);
    const float weight = BorderWeight(*brick, 0, dy);
    for (int k = 0; k < box.layers; ++k) {
      const float* own = &theta[BrickThetaIndex(0, inside, k)];
      float* halo = &theta[BrickThetaIndex(0, inside + dy, k)];
      for (int i = box.col0; i < box.col1; ++i) {
        const bool joined = weight > 0.0f && other->box.Holds(i, beyond, k);
        const float theirs = joined ? other->theta[BrickThetaIndex(i, beyond, k)] : own[i];
        halo[i] = own[i] + weight * (theirs - own[i]);
      }
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
    for (int j = box.row0; j < box.row1; j += kBoxRows) {
      high = std::max(high, brick->pair_max[k * kBrickPairs + j / kBoxRows]);
    }
    bad = bad || !std::isfinite(brick->layer_sum[k]);  // a maximum ignores NaN
  }
  brick->theta_max = high;
  if (!bad && high <= kThetaPlausible) return;
  for (int k = 0; k < box.layers; ++k) {
    for (int j = box.row0; j < box.row1; ++j) {
      for (int i = box.col0; i < box.col1; ++i) {
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
  RestoreTotals({});
}

}  // namespace fulcrum::thermal
