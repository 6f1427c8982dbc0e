// Where the current of the source window goes: the leak to the tissue beneath, the far field beyond the window, and the
// Joule heat there, sigma (dV/dr)^2, tented ~ 1 / r^2, in a band that of a strip (band_field). All for a sheet of one
// conductivity and the metric under the tip.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "thermal_node/coupling/band_field.h"
#include "thermal_node/coupling/source_window.h"
#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Heat beyond the window is put within this distance from it, at most two decay lengths [m]: more would keep more
/// tiles awake (deploy/docs/measurements/thermal, Heat beyond the window).
constexpr float kFarReach_m = 3e-3f;
/// Squares of cells that get one density.
constexpr int kBlock = 8, kBlocks = kTile / kBlock;
/// Distances in decay lengths: the solution is followed inward from at most the first, at least the second. Assumed.
constexpr double kMostLengths = 100, kLeastLengths = 5;
constexpr double kLogStep = -0.01;  ///< Of ln r.

/// The part of a tile that lies beyond the window, and the density of heat in its columns, by rows of blocks: of rows
/// beyond the window and of those that cross it.
struct Part {
  using Row = std::array<float, kTile>;
  int tx, ty;
  int first_row, end_row;  ///< Rows that cross the window.
  alignas(64) std::array<Row, kBlocks> beyond{}, crossing{};

  [[nodiscard]] bool Crosses(int row) const { return row >= first_row && row < end_row; }
  [[nodiscard]] const Row& DensityOf(int row) const {
    return (Crosses(row) ? crossing : beyond)[static_cast<std::size_t>(row / kBlock)];
  }
};

double SumOf(const Part::Row& row) {
  double sum = 0;
  for (const float density : row) sum += static_cast<double>(density);
  return sum;
}

/// Adds `scale` times the density to the enthalpy of tissue. Returns what was added, times the cells' areas.
FULCRUM_WIDE
float HeatCells(const Part& part, float scale, Tile* tile) {
  alignas(64) float sum[kTile] = {};
  for (int j = 0; j < kTile; ++j) {
    const float* __restrict density = part.DensityOf(j).data();
    const std::uint8_t* __restrict flags = &tile->state.flags[j * kTile];
    const float* __restrict area = &tile->geometry.area[j * kTile];
    float* __restrict h = &tile->state.enthalpy[j * kTile];
    // Two loops: in one the choice would become a branch, which is not vectorised.
    alignas(64) std::array<int, kTile> missing;
    for (int i = 0; i < kTile; ++i) missing[i] = static_cast<int>((flags[i] & kNoTissue) != 0);
    for (int i = 0; i < kTile; ++i) {
      const float heated = static_cast<float>(1 - missing[i]) * scale * density[i];
      h[i] += heated;
      sum[i] += heated * area[i];
    }
  }
  float total = 0;
  for (const float s : sum) total += s;
  return total;
}

/// A row of cells of the window: its first cell's place from the middle of the metal in material space, and rest
/// lengths, in cells.
struct LeakRow {
  SurfaceMetric metric;
  float x0, y;
  float even;         ///< Conductance of a cell to the tissue beneath, of a long wave [S].
  float least, wave;  ///< The metal's radius, and what over the radius gives the ratio to `even`.
};

FULCRUM_WIDE
void LeakOfRow(const LeakRow& row, const float* __restrict tissue, float* __restrict leak) {
  const float ss = row.metric.ss, cross = 2.0f * row.metric.st * row.y, of_row = row.metric.tt * row.y * row.y;
  for (int i = 0; i < kWindow; ++i) {
    const float x = row.x0 + static_cast<float>(i), r = std::sqrt((ss * x + cross) * x + of_row);
    leak[i] = row.even * LeakRatio(row.wave / (r > row.least ? r : row.least));
  }
  for (int i = 0; i < kWindow; ++i) leak[i] = tissue[i] > 0.0f ? leak[i] : 0.0f;
}

}  // namespace

/// The slope y = -V'/V follows y' = y^2 - y/r - g/(sigma d) from the asymptote y = (1 + l/2r)/l of constant g, inward,
/// where the wanted solution attracts the others.
FarField::FarField(const Material& material) : spacing_(kSpacing * kWindow * material.cell_m) {
  const double sheet = static_cast<double>(material.sigma * material.thickness_m);
  const double even = std::max<double>(material.leak_S_m2, 1e-3), length = std::sqrt(sheet / even);
  const double wave = static_cast<double>(material.spreading * material.fat_depth_m);
  const auto g = [&](double r) {
    const auto ratio = static_cast<double>(LeakRatio(static_cast<float>(wave / r)));
    return std::max(ratio * static_cast<double>(material.leak_S_m2), 1e-3) / sheet;
  };
  const auto asymptote = [&](double r) { return (1 + 0.5 * length / r) / length; };
  const double spacing = static_cast<double>(spacing_), last = spacing * (kCount - 1);
  double r = std::max(std::min(last, kMostLengths * length), kLeastLengths * length);
  double y = asymptote(r), log_v = 0;
  double heat = 0.5 * y * r;  // integral of V'^2 r over what is beyond, over V^2; half of the power of a long wave
  Table log_density{};
  std::size_t n = kCount;
  for (; n > 0 && static_cast<double>(n - 1) * spacing >= r; --n) {
    const double at = static_cast<double>(n - 1) * spacing;
    slope_[n - 1] = static_cast<float>(asymptote(at));
    share_[n - 1] = 0.5f;
    log_density[n - 1] = static_cast<float>(-2 * (at - r) / length + 2 * std::log(y));
  }
  for (; n > 1;) {
    // To the next step, or to the next entry of the table, whichever comes first.
    const double entry = static_cast<double>(n - 1) * spacing;
    const double next = std::max(r * std::exp(kLogStep), entry), step = std::log(next / r);
    const auto rate = [&](double at, double slope) { return at * (slope * slope - g(at)) - slope; };
    const double middle = std::sqrt(r * next);
    const double k1 = rate(r, y), k2 = rate(middle, y + 0.5 * step * k1), k3 = rate(middle, y + 0.5 * step * k2);
    const double after = y + step / 6 * (k1 + 2 * k2 + 2 * k3 + rate(next, y + step * k3));
    // Trapezoids in ln r; V grows by the factor exp(grown).
    const double grown = -0.5 * step * (y * r + after * next);
    heat = (heat - 0.5 * step * y * y * r * r) * std::exp(-2 * grown) - 0.5 * step * after * after * next * next;
    log_v += grown;
    r = next;
    y = after;
    if (r > entry) continue;
    --n;
    slope_[n] = static_cast<float>(y);
    share_[n] = static_cast<float>(heat / (r * y));
    log_density[n] = static_cast<float>(2 * (log_v + std::log(y)));
  }
  slope_[0] = slope_[1];
  share_[0] = share_[1];
  log_density[0] = log_density[1];
  for (n = 0; n < kCount; ++n) density_[n] = std::exp(log_density[n] - log_density[1]);
  reach_m_ = 0.5f * kWindow * material.cell_m + std::min(2 * static_cast<float>(length), kFarReach_m);
}

float FarField::At(const Table& table, float r_m) const {
  const float x = std::min(r_m / spacing_, static_cast<float>(kCount) - 1.001f);
  const int n = static_cast<int>(x);
  const float f = x - static_cast<float>(n);
  return table[n] + f * (table[n + 1] - table[n]);
}

float SourceWindow::MetalRadius() const {
  float covered = 0;
  for (int j = gap_low_.iy; j <= gap_high_.iy; ++j) {
    for (int i = gap_low_.ix; i <= gap_high_.ix; ++i) covered += Electrode::Covered(gap_[j * kWindow + i]);
  }
  return std::max(std::sqrt(covered * metric_.area() / std::numbers::pi_v<float>), 1.0f);
}

void SourceWindow::SetLeak(const Vec2f& middle, bool tented) {
  const float cell = material_->cell_m, even = tented ? 0.0f : material_->leak_S_m2 * cell * cell * metric_.area();
  const float least = MetalRadius(), wave = material_->spreading * material_->fat_depth_m / cell;
  const float x0 = static_cast<float>(corner_.ix + sheet_.origin_x) + 0.5f - middle.x() / cell;
  const float y0 = static_cast<float>(corner_.iy + sheet_.origin_y) + 0.5f - middle.y() / cell;
  for (int j = 0; j < kWindow; ++j) {
    const LeakRow row{metric_, x0, y0 + static_cast<float>(j), even, least, wave};
    LeakOfRow(row, &tissue_[j * kWindow], &leak_[j * kWindow]);
  }
}

/// What the band is spanned between is at 0 V, half a cell beyond its last cells.
void SourceWindow::GroundEnds(const Band& band) {
  for (const CellIndex& cell : band.ends) {
    const int i = cell.ix - corner_.ix, j = cell.iy - corner_.iy;
    if (i < 0 || j < 0 || i >= kWindow || j >= kWindow) continue;
    const int k = j * kWindow + i;
    problem_.ground[k] += 2.0f * problem_.face_t * problem_.sigma[k];
  }
}

void SourceWindow::SetGround(const Vec2f& middle, bool tented) {
  const float cell = material_->cell_m;
  problem_.ground = leak_;
  std::optional<BandField> strip;
  if (const Band* band = sheet_.BandOf(number_)) {
    strip.emplace(*band, middle);
    GroundEnds(*band);
  }
  const FarField& far = far_[static_cast<std::size_t>(number_)];
  // Current that leaves the window: the conductance of the sheet's far field at each face of the border, in series with
  // the half cell before it.
  far_middle_ = middle;
  far_tented_ = tented;
  std::size_t face_count = 0;
  const auto stretch = [&](const Vec2f& normal) { return metric_.Length(normal.x(), normal.y()); };
  const auto add = [&](int i, int j, float face, const Vec2f& normal) {
    const Vec2f r_cells = Vec2f(static_cast<float>(corner_.ix + i + sheet_.origin_x) + 0.5f,
                                static_cast<float>(corner_.iy + j + sheet_.origin_y) + 0.5f) +
                          0.5f * normal - middle / cell;
    const float r_m = std::max(metric_.Length(r_cells.x(), r_cells.y()), 1.0f) * cell;
    const float kappa = tented ? 1.0f / (r_m * std::log(std::max(kTentRadius_m / r_m, 1.2f))) : far.SlopeAt(r_m);
    // Growth of the distance from the metal across the cell, in material lengths: d|r|/ds = (g r)_s / |r|.
    const float growth = (metric_.ss * r_cells.x() + metric_.st * r_cells.y()) * normal.x() +
                         (metric_.st * r_cells.x() + metric_.tt * r_cells.y()) * normal.y();
    // Relative slope of the potential per cell.
    const float slope = strip ? cell * stretch(normal) * strip->SlopeAt(r_cells * cell + middle, normal)
                              : cell * kappa * std::max(0.0f, growth * cell / r_m);
    const float conductance = face * problem_.sigma[j * kWindow + i] * slope / (1.0f + 0.5f * slope);
    // The half cell's heat, two hundredths of it, is counted as heat beyond.
    const float share = tented || strip ? 1.0f : far.ShareAt(r_m);
    problem_.ground[j * kWindow + i] += conductance;
    border_[face_count++] = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j), share * conductance,
                             (1.0f - share) * conductance};
  };
  for (int n = 0; n < kWindow; ++n) {
    add(0, n, problem_.face_s, -Vec2f::UnitX());
    add(kWindow - 1, n, problem_.face_s, Vec2f::UnitX());
    add(n, 0, problem_.face_t, -Vec2f::UnitY());
    add(n, kWindow - 1, problem_.face_t, Vec2f::UnitY());
  }
}

void SourceWindow::AddLeak(float v2_s) {
  for (int j = 0; j < kWindow; ++j) {
    for (int i = 0; i < kWindow; ++i) {
      const int k = j * kWindow + i;
      const float volts = potential_.Voltage(i, j);
      const float squared = leak_[k] > 0.0f ? v2_s * volts * volts : 0.0f;
      leak_V2s_[k] += squared;
      stats_.leak_J += static_cast<double>(leak_[k] * squared);
    }
  }
}

void SourceWindow::AddFar(float v2_s) {
  double sheet_S = 0, leak_S = 0;
  for (const BorderFace& face : border_) {
    const float volts = potential_.Voltage(face.i, face.j);
    sheet_S += static_cast<double>(face.sheet_S * volts * volts);
    leak_S += static_cast<double>(face.leak_S * volts * volts);
  }
  const double energy = static_cast<double>(v2_s) * solved_.scale;
  far_J_ += energy * sheet_S;
  stats_.far_leak_J += energy * leak_S;
}

/// The density is that of a sheet without holes or border: where tissue is missing, its heat is not put elsewhere.
void SourceWindow::DepositFar(HeatField* field, bool hold, Ledger* ledger) {
  const double heat = std::exchange(far_J_, 0.0);
  if (!(heat > 0.0)) return;
  const FarField& far = far_[static_cast<std::size_t>(number_)];
  const float cell = material_->cell_m, reach = far.reach_m() / cell;
  // Middle in cells of the sheet's tiles.
  const Vec2f origin(static_cast<float>(sheet_.origin_x), static_cast<float>(sheet_.origin_y));
  const Vec2f middle = far_middle_ / cell - origin;
  // The box around the ellipse that the circle of this rest radius is in material space.
  const Vec2f half = reach / metric_.area() * Vec2f(std::sqrt(metric_.tt), std::sqrt(metric_.ss));
  Vec2f low = middle - half, high = middle + half;
  std::optional<BandField> strip;
  if (const Band* band = sheet_.BandOf(number_)) {
    strip.emplace(*band, far_middle_);
    low = band->low / cell - origin;
    high = low + band->size / cell;
  }
  const auto tile_of = [](float cells) { return static_cast<int>(std::floor(cells / kTile)); };
  const auto density_at = [&](int ix, int iy) {
    const Vec2f centre = Vec2f(static_cast<float>(ix), static_cast<float>(iy)) + Vec2f::Constant(0.5f * kBlock);
    if (strip) return strip->DensityAt((centre + origin) * cell);
    const Vec2f away = centre - middle;
    const float r = std::max(metric_.Length(away.x(), away.y()), 1.0f);
    return r >= reach ? 0.0f : far_tented_ ? 1.0f / (r * r) : far.DensityAt(r * cell);
  };
  const int columns = tile_of(high.x()) - tile_of(low.x()) + 1, rows = tile_of(high.y()) - tile_of(low.y()) + 1;
  std::vector<Part> parts;
  parts.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  double cells = 0;  // of density
  for (int ty = tile_of(low.y()); ty <= tile_of(high.y()); ++ty) {
    for (int tx = tile_of(low.x()); tx <= tile_of(high.x()); ++tx) {
      const int column = corner_.ix - tx * kTile, row = corner_.iy - ty * kTile;  // where the window begins
      Part part{tx, ty, row, row + kWindow};
      for (int block = 0; block < kBlocks; ++block) {
        for (int i = 0; i < kTile; ++i) {
          part.beyond[block][i] =
              i % kBlock == 0 ? density_at(tx * kTile + i, ty * kTile + block * kBlock) : part.beyond[block][i - 1];
          part.crossing[block][i] = i >= column && i < column + kWindow ? 0.0f : part.beyond[block][i];
        }
      }
      std::array<double, kBlocks> of_beyond{}, of_crossing{};
      for (std::size_t block = 0; block < kBlocks; ++block) {
        of_beyond[block] = SumOf(part.beyond[block]);
        of_crossing[block] = SumOf(part.crossing[block]);
      }
      double of_tile = 0;
      for (int j = 0; j < kTile; ++j) {
        of_tile += (part.Crosses(j) ? of_crossing : of_beyond)[static_cast<std::size_t>(j / kBlock)];
      }
      if (of_tile > 0.0) parts.push_back(part);
      cells += of_tile;
    }
  }
  if (!(cells > 0.0)) return;
  const double volume = static_cast<double>(cell * cell * material_->thickness_m * metric_.area());
  const auto scale = static_cast<float>(heat / (cells * volume));
  if (!std::isfinite(scale)) return;  // where the density at the border is next to nothing
  for (const Part& part : parts) {
    Tile* const tile = TileAt(field, part.tx * kTile, part.ty * kTile);
    if (tile == nullptr) continue;
    const float given = HeatCells(part, scale, tile);
    ledger->joule += static_cast<double>(given) * static_cast<double>(tile->flat_volume);
    tile->held = tile->held || hold;
    field->RefreshTheta(tile, ledger);
    field->Boil(tile, ledger);
  }
}

}  // namespace fulcrum::thermal
