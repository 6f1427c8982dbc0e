// Heat of the current beyond the window: the far field of the leaky sheet, V ~ K0(r / lambda), lambda = sqrt(sigma d /
// g) with g the leak; tented V ~ log(R / r). Its Joule heat is sigma (dV/dr)^2 ~ K1(r / lambda)^2 or 1 / r^2.
#include <algorithm>
#include <cmath>

#include "thermal_node/coupling/source_window.h"
#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Heat beyond the window is put down to this distance from it, at most 2 lambda, where the density is a fiftieth [m];
/// assumed.
constexpr float kFarReach_m = 3e-3f;
/// Squares of cells that get one density.
constexpr int kBlock = 8, kBlocks = kTile / kBlock;
constexpr double kLargestArgument = 300.0;  ///< K0 underflows beyond.

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

}  // namespace

FarField::FarField(const Material& material) : spacing_(kSpacing * kWindow * material.cell_m) {
  const double lambda = std::sqrt(material.sigma * material.thickness_m / std::max(material.leak_S_m2, 1e-3f));
  for (std::size_t n = 0; n < kCount; ++n) {
    const double r = static_cast<double>(std::max<std::size_t>(n, 1)) * static_cast<double>(spacing_);
    const double x = std::min(r / lambda, kLargestArgument);
    const double k0 = std::cyl_bessel_k(0.0, x), k1 = std::cyl_bessel_k(1.0, x), k2 = std::cyl_bessel_k(2.0, x);
    slope_[n] = static_cast<float>(k1 / k0 / lambda);
    density_[n] = static_cast<float>(k1 * k1);
    // Integral of K1(t)^2 t over t > x, over x K0(x) K1(x), which stands for the current's power at x.
    share_[n] = static_cast<float>(0.5 * x * (k0 * k2 - k1 * k1) / (k0 * k1));
  }
  reach_m_ = 0.5f * kWindow * material.cell_m + std::min(2 * static_cast<float>(lambda), kFarReach_m);
}

float FarField::At(const Table& table, float r_m) const {
  const float x = std::min(r_m / spacing_, static_cast<float>(kCount) - 1.001f);
  const int n = static_cast<int>(x);
  const float f = x - static_cast<float>(n);
  return table[n] + f * (table[n + 1] - table[n]);
}

/// The density is that of a sheet without holes or border: where tissue is missing, its heat is not put elsewhere.
void SourceWindow::DepositFar(HeatField* field, bool hold, Ledger* ledger) {
  const double heat = std::exchange(far_J_, 0.0);
  if (!(heat > 0.0)) return;
  const float cell = material_.cell_m, reach = (far_tented_ ? kTentRadius_m : far_.reach_m()) / cell;
  // Middle in cells of the sheet's tiles.
  const Vec2f origin(static_cast<float>(sheet_.origin_x), static_cast<float>(sheet_.origin_y));
  const Vec2f middle = far_middle_ / cell - origin;
  const auto tile_of = [](float cells) { return static_cast<int>(std::floor(cells / kTile)); };
  const auto density_at = [&](int ix, int iy) {
    const Vec2f centre = Vec2f(static_cast<float>(ix), static_cast<float>(iy)) + Vec2f::Constant(0.5f * kBlock);
    const float r = std::max((centre - middle).norm(), 1.0f);
    return r >= reach ? 0.0f : far_tented_ ? 1.0f / (r * r) : far_.DensityAt(r * cell);
  };
  std::vector<Part> parts;
  double cells = 0;  // of density
  for (int ty = tile_of(middle.y() - reach); ty <= tile_of(middle.y() + reach); ++ty) {
    for (int tx = tile_of(middle.x() - reach); tx <= tile_of(middle.x() + reach); ++tx) {
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
  const double volume = static_cast<double>(cell * cell * material_.thickness_m * metric_.area());
  const auto scale = static_cast<float>(heat / (cells * volume));
  for (const Part& part : parts) {
    Tile* const tile = field->Wake(part.tx, part.ty);
    if (tile == nullptr) continue;
    const float given = HeatCells(part, scale, tile);
    ledger->joule += static_cast<double>(given) * static_cast<double>(tile->flat_volume);
    tile->state.tented = far_tented_ ? 1 : 0;
    tile->held = tile->held || hold;
    field->RefreshTheta(tile, ledger);
    field->Boil(tile, ledger);
  }
}

}  // namespace fulcrum::thermal
