#include "services/records/log_tools/mask.h"

#include <cmath>
#include <limits>
#include <span>

namespace fulcrum::log_tools {
namespace {

constexpr double kFar = 1e18;

/// Lower envelope of the parabolas (x - i)^2 + f[i], sampled at the integers. `f` is replaced.
class Envelope {
 public:
  explicit Envelope(std::size_t longest) : parabola_(longest), from_(longest + 1), source_(longest) {}

  void Apply(std::span<double> f) {
    const std::size_t n = f.size();
    source_.assign(f.begin(), f.end());
    std::size_t last = 0;
    parabola_[0] = 0;
    from_[0] = -std::numeric_limits<double>::infinity();
    from_[1] = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < n; ++i) {
      double cross = Crossing(i, parabola_[last]);
      while (cross <= from_[last]) cross = Crossing(i, parabola_[--last]);
      parabola_[++last] = i;
      from_[last] = cross;
      from_[last + 1] = std::numeric_limits<double>::infinity();
    }
    std::size_t at = 0;
    for (std::size_t i = 0; i < n; ++i) {
      while (from_[at + 1] < static_cast<double>(i)) ++at;
      const double step = static_cast<double>(i) - static_cast<double>(parabola_[at]);
      f[i] = step * step + source_[parabola_[at]];
    }
  }

 private:
  [[nodiscard]] double Crossing(std::size_t i, std::size_t j) const {
    const double a = static_cast<double>(i), b = static_cast<double>(j);
    return ((source_[i] + a * a) - (source_[j] + b * b)) / (2 * (a - b));
  }

  std::vector<std::size_t> parabola_;
  std::vector<double> from_, source_;
};

}  // namespace

std::vector<float> DistanceToClear(const Mask& mask) {
  // Adds a clear border on all sides, because everything outside is clear.
  const std::size_t w = static_cast<std::size_t>(mask.width) + 2, h = static_cast<std::size_t>(mask.height) + 2;
  std::vector<double> squared(w * h, 0);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.set[mask.Index(x, y)] != 0) {
        squared[(static_cast<std::size_t>(y) + 1) * w + static_cast<std::size_t>(x) + 1] = kFar;
      }
    }
  }
  Envelope envelope(std::max(w, h));
  std::vector<double> column(h);
  for (std::size_t x = 0; x < w; ++x) {
    for (std::size_t y = 0; y < h; ++y) column[y] = squared[y * w + x];
    envelope.Apply(column);
    for (std::size_t y = 0; y < h; ++y) squared[y * w + x] = column[y];
  }
  std::vector<float> distance(mask.set.size());
  for (std::size_t y = 0; y < h; ++y) {
    const std::span<double> row(&squared[y * w], w);
    envelope.Apply(row);
    if (y == 0 || y + 1 == h) continue;
    for (std::size_t x = 1; x + 1 < w; ++x) {
      distance[(y - 1) * (w - 2) + x - 1] = static_cast<float>(std::sqrt(row[x]));
    }
  }
  return distance;
}

Pieces FindPieces(const Mask& mask, bool value, Neighbours neighbours) {
  Pieces found;
  found.label.assign(mask.set.size(), -1);
  std::vector<std::pair<int, int>> open;
  for (int y0 = 0; y0 < mask.height; ++y0) {
    for (int x0 = 0; x0 < mask.width; ++x0) {
      if (found.label[mask.Index(x0, y0)] >= 0 || mask.At(x0, y0) != value) continue;
      const int number = static_cast<int>(found.pieces.size());
      Piece piece;
      found.label[mask.Index(x0, y0)] = number;
      open.assign(1, {x0, y0});
      while (!open.empty()) {
        const auto [x, y] = open.back();
        open.pop_back();
        ++piece.pixels;
        piece.at_border |= x == 0 || y == 0 || x + 1 == mask.width || y + 1 == mask.height;
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            if (neighbours == Neighbours::kFour && dx != 0 && dy != 0) continue;
            const int nx = x + dx, ny = y + dy;
            if (!mask.Contains(nx, ny) || mask.At(nx, ny) != value || found.label[mask.Index(nx, ny)] >= 0) continue;
            found.label[mask.Index(nx, ny)] = number;
            open.emplace_back(nx, ny);
          }
        }
      }
      found.pieces.push_back(piece);
    }
  }
  return found;
}

Mask Doubled(const Mask& mask) {
  Mask twice(2 * mask.width, 2 * mask.height);
  for (int y = 0; y < twice.height; ++y) {
    for (int x = 0; x < twice.width; ++x) twice.set[twice.Index(x, y)] = mask.set[mask.Index(x / 2, y / 2)];
  }
  return twice;
}

}  // namespace fulcrum::log_tools
