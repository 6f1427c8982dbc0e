#include "render_node/geometry/cut_contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr float kLevel = 127.5f;        // Of the fourth channel, as membrane.frag ends the sheet.
constexpr std::size_t kSmoothings = 6;  // Of weights (1, 2, 1) / 4: a standard deviation of 1.7 points of half a texel.

/// A piece of the contour within a square of four texels; tissue is to its left. An edge of the square is numbered by
/// its lower left texel: 2 * texel to the right of it, 2 * texel + 1 above it.
struct Piece {
  std::size_t from, to;
};

class Squares {
 public:
  explicit Squares(const Atlas& atlas) : atlas_(atlas) {}

  /// Adds the pieces of the square whose lower left texel is (x, y).
  void Add(int x, int y, std::vector<Piece>* pieces) const {
    const std::array<float, 4> corner{Alive(x, y), Alive(x + 1, y), Alive(x + 1, y + 1), Alive(x, y + 1)};
    int inside = 0;
    for (std::size_t k = 0; k < 4; ++k) inside |= corner[k] >= kLevel ? 1 << k : 0;
    if (inside == 0 || inside == 15) return;
    const std::size_t texel = TexelIndex(x, y, atlas_.width());
    // Below, right, above, left.
    const std::array<std::size_t, 4> edge{2 * texel, 2 * (texel + 1) + 1,
                                          2 * (texel + static_cast<std::size_t>(atlas_.width())), 2 * texel + 1};
    // Each corner of tissue that follows a removed one, counter-clockwise, begins a run of tissue; the piece goes from
    // where the run ends to where it begins, so two opposite corners are two runs.
    for (std::size_t k = 0; k < 4; ++k) {
      const auto is_in = [inside](std::size_t j) { return ((inside >> (j % 4)) & 1) != 0; };
      if (!is_in(k) || is_in(k + 3)) continue;
      std::size_t last = k;
      while (is_in(last + 1)) ++last;
      pieces->push_back({edge[last % 4], edge[(k + 3) % 4]});
    }
  }

  /// Where the contour crosses an edge, (s, t) [m].
  [[nodiscard]] Vec2f Crossing(std::size_t edge) const {
    const auto width = static_cast<std::size_t>(atlas_.width());
    const int x = static_cast<int>(edge / 2 % width), y = static_cast<int>(edge / 2 / width);
    const bool up = edge % 2 == 1;
    const float a = Alive(x, y), b = up ? Alive(x, y + 1) : Alive(x + 1, y);
    const float along = (kLevel - a) / (b - a);
    return atlas_.texel_m() *
           Vec2f(static_cast<float>(x) + 0.5f + (up ? 0 : along), static_cast<float>(y) + 0.5f + (up ? along : 0));
  }

 private:
  [[nodiscard]] float Alive(int x, int y) const {
    return static_cast<float>(atlas_.texels()[4 * TexelIndex(x, y, atlas_.width()) + 3]);
  }
  const Atlas& atlas_;
};

void SmoothLine(bool closed, std::vector<Vec2f>* line) {
  const std::size_t n = line->size();
  // A small hole would vanish.
  const std::size_t passes = closed ? std::min(kSmoothings, n / 8) : kSmoothings;
  std::vector<Vec2f> before;
  for (std::size_t pass = 0; pass < passes; ++pass) {
    before = *line;
    for (std::size_t k = closed ? 0 : 1; k < (closed ? n : n - 1); ++k) {
      (*line)[k] = 0.25f * (before[(k + n - 1) % n] + 2 * before[k] + before[(k + 1) % n]);
    }
  }
}

Contour Resampled(const std::vector<Vec2f>& line, bool closed, float spacing_m) {
  Contour contour;
  contour.closed = closed;
  const std::size_t n = line.size(), pieces = closed ? n : n - 1;
  float length = 0;
  for (std::size_t k = 0; k < pieces; ++k) length += (line[(k + 1) % n] - line[k]).norm();
  const std::size_t least = closed ? 5 : 1;
  const std::size_t steps = std::max(least, static_cast<std::size_t>(std::lround(length / spacing_m)));
  const std::size_t count = closed ? steps : steps + 1;
  std::size_t piece = 0;
  float passed = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const float at = length * static_cast<float>(k) / static_cast<float>(steps);
    float own = (line[(piece + 1) % n] - line[piece]).norm();
    while (piece + 1 < pieces && passed + own < at) {
      passed += own;
      ++piece;
      own = (line[(piece + 1) % n] - line[piece]).norm();
    }
    const float share = own > 0 ? std::clamp((at - passed) / own, 0.0f, 1.0f) : 0.0f;
    contour.points.push_back({line[piece] + share * (line[(piece + 1) % n] - line[piece]), Vec2f::Zero()});
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t before = k > 0 ? k - 1 : closed ? count - 1 : 0;
    const std::size_t after = k + 1 < count ? k + 1 : closed ? 0 : k;
    const Vec2f along = contour.points[after].material - contour.points[before].material;
    const float norm = along.norm();
    contour.points[k].inward = norm > 0 ? Vec2f(-along.y() / norm, along.x() / norm) : Vec2f(1, 0);
  }
  return contour;
}

}  // namespace

std::vector<Contour> FindContours(const Atlas& atlas, float spacing_m) {
  const Squares squares(atlas);
  std::vector<Piece> pieces;
  atlas.ForEachSquareNearCuts([&](int x, int y) { squares.Add(x, y, &pieces); });
  std::ranges::sort(pieces, {}, &Piece::from);
  const auto from = [&pieces](std::size_t edge) {
    const auto found = std::ranges::lower_bound(pieces, edge, {}, &Piece::from);
    return found != pieces.end() && found->from == edge ? static_cast<std::size_t>(found - pieces.begin())
                                                        : pieces.size();
  };
  std::vector<std::size_t> next(pieces.size());
  std::vector<std::uint8_t> followed(pieces.size(), 0), taken(pieces.size(), 0);
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    next[k] = from(pieces[k].to);
    if (next[k] < pieces.size()) followed[next[k]] = 1;
  }
  std::vector<Contour> contours;
  const auto follow = [&](std::size_t start) {
    std::vector<Vec2f> line{squares.Crossing(pieces[start].from)};
    std::size_t k = start;
    for (; k < pieces.size() && taken[k] == 0; k = next[k]) {
      taken[k] = 1;
      line.push_back(squares.Crossing(pieces[k].to));
    }
    const bool closed = k == start;
    if (closed) line.pop_back();
    SmoothLine(closed, &line);
    contours.push_back(Resampled(line, closed, spacing_m));
  };
  // Lines from border to border first, then those that are closed.
  for (const bool open : {true, false}) {
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      if (taken[k] == 0 && (followed[k] == 0) == open) follow(k);
    }
  }
  return contours;
}

}  // namespace fulcrum::render
