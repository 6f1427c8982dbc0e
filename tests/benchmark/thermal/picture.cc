#include "tests/benchmark/thermal/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/benchmark/thermal/canvas.h"

namespace fulcrum::thermal {
namespace {

constexpr int kPixels = 480, kGap = 12, kTop = 30, kBottom = 40;
constexpr int kWidth = 3 * kPixels + 4 * kGap, kHeight = kTop + kPixels + kBottom;
constexpr int kLegend = kTop + kPixels + 12;  ///< Upper border of the legends.
constexpr float kThetaShown = 70;             ///< Temperature shown as white [K].
constexpr Rgb kPaper{250, 250, 250}, kInk{20, 20, 20}, kHole{0, 0, 0}, kOffSheet{110, 110, 110};
constexpr Rgb kTissue{235, 170, 150}, kDead{250, 240, 225}, kBrown{150, 95, 45}, kDry{90, 50, 20}, kChar{60, 60, 70};
constexpr Rgb kMeshGround{60, 60, 60}, kEdge{200, 200, 200}, kShrunk{255, 60, 30};

constexpr int LeftOf(int panel) { return kGap + panel * (kPixels + kGap); }

Rgb Heat(float theta) {
  constexpr std::array<Rgb, 5> kScale{{{20, 20, 60}, {120, 20, 120}, {230, 60, 40}, {255, 180, 40}, {255, 255, 220}}};
  const float x = std::clamp(theta / kThetaShown, 0.0f, 0.999f) * 4;
  const int k = static_cast<int>(x);
  return Mix(kScale[k], kScale[k + 1], x - static_cast<float>(k));
}

Rgb Damage(const TileState& s, int k) {
  Rgb colour = Mix(kTissue, kDead, 1 - std::exp(-s.omega_cell[k]));
  colour = Mix(colour, kBrown, 1 - std::exp(-s.omega_collagen[k]));
  colour = Mix(colour, kDry, 1 - s.water[k]);
  return Mix(colour, kChar, s.charred[k]);
}

/// Part of the sheet that is shown.
struct Frame {
  Vec2f centre;
  float width_m;
  [[nodiscard]] Vec2f Material(int x, int y) const {
    return centre + width_m * Vec2f((static_cast<float>(x) + 0.5f) / kPixels - 0.5f,
                                    (static_cast<float>(y) + 0.5f) / kPixels - 0.5f);
  }
  [[nodiscard]] Vec2f Pixel(const Vec2f& material) const {
    return ((material - centre) / width_m + Vec2f(0.5f, 0.5f)) * kPixels;
  }
};

void DrawCells(const HeatField& field, const Frame& frame, Canvas* canvas) {
  for (int y = 0; y < kPixels; ++y) {
    for (int x = 0; x < kPixels; ++x) {
      const auto put = [&](const Rgb& heat, const Rgb& damage, const Rgb& mesh) {
        canvas->Put(LeftOf(0) + x, kTop + y, heat);
        canvas->Put(LeftOf(1) + x, kTop + y, damage);
        canvas->Put(LeftOf(2) + x, kTop + y, mesh);
      };
      const Vec2f p = frame.Material(x, y);
      if (!field.sheet().OnSheet(p)) {
        put(kOffSheet, kOffSheet, kOffSheet);
        continue;
      }
      const CellIndex cell = field.sheet().CellOf(p);
      const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
      const int k = (cell.iy % kTile) * kTile + cell.ix % kTile;
      if (tile == nullptr) {
        put(Heat(0), kTissue, kMeshGround);
      } else if ((tile->state.flags[k] & kRemoved) != 0) {
        put(kHole, kHole, kHole);
      } else {
        put(Heat(tile->theta[ThetaIndex(cell.ix % kTile, cell.iy % kTile)]), Damage(tile->state, k), kMeshGround);
      }
    }
  }
}

/// Live edges, the redder the more they have shrunk. Points outside the panel are skipped.
void DrawMesh(const SceneView& scene, const TopologyBits& bits, float shrink_max, const Frame& frame, Canvas* canvas) {
  const std::uint32_t cols = scene.membrane.cols;
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] <= 0 || TestBit(bits.dead_edges, e)) continue;
    const std::size_t node = e / 3;
    const std::size_t other = e % 3 == 0 ? node + 1 : (e % 3 == 1 ? node + cols : node + cols + 1);
    const Vec2f a = frame.Pixel(scene.membrane_material[node]), b = frame.Pixel(scene.membrane_material[other]);
    const float shrink = std::min(1.0f, static_cast<float>(bits.shrink[e]) * kShrinkUnit / shrink_max);
    const Rgb colour = Mix(kEdge, kShrunk, shrink);
    const int steps = 1 + static_cast<int>((b - a).cwiseAbs().maxCoeff());
    for (int n = 0; n <= steps; ++n) {
      const Vec2f p = a + (b - a) * (static_cast<float>(n) / static_cast<float>(steps));
      if (p.minCoeff() < 0 || p.maxCoeff() >= kPixels) continue;
      const int x = LeftOf(2) + static_cast<int>(p.x()), y = kTop + static_cast<int>(p.y());
      canvas->Put(x, y, colour);
      if (shrink > 0 && p.x() + 1 < kPixels) canvas->Put(x + 1, y, colour);  // so that a shrunk edge is seen
    }
  }
}

/// Colour bar from `from` to `to`, with numbers at the ticks.
template <class Colour>
void DrawBar(int left, float from, float to, const std::vector<float>& ticks, const std::string& unit,
             const Colour& colour, Canvas* canvas) {
  constexpr int kBar = 300, kThick = 8;
  for (int x = 0; x < kBar; ++x) {
    const float value = std::lerp(from, to, static_cast<float>(x) / kBar);
    canvas->Box(left + x, kLegend - 6, left + x + 1, kLegend - 6 + kThick, colour(value));
  }
  for (const float tick : ticks) {
    const int x = left + static_cast<int>(kBar * (tick - from) / (to - from));
    canvas->Box(x, kLegend - 6, x + 1, kLegend + 5, kInk);
    const std::string label = std::to_string(std::lround(tick));
    const int half = static_cast<int>(label.size()) * Canvas::kLetterWidth / 2;
    canvas->Text(std::max(x - half, left), kLegend + 9, label, kInk);
  }
  canvas->Text(left + kBar + 12, kLegend - 6, unit, kInk);
}

void DrawLegends(float body_C, float shrink_max, float width_m, Canvas* canvas) {
  canvas->Text(LeftOf(0), 8, "TEMPERATURE", kInk);
  canvas->Text(LeftOf(1), 8, "DAMAGE", kInk);
  canvas->Text(LeftOf(2), 8, "MESH", kInk);
  // Scale in the title's line, so that it hides nothing.
  const int length = static_cast<int>(std::lround(0.002f / width_m * kPixels));
  for (int panel = 0; panel < 3; ++panel) {
    const int right = LeftOf(panel) + kPixels;
    canvas->Box(right - length, 18, right, 22, kInk);
    canvas->Text(right - length - 5 * Canvas::kLetterWidth, 8, "2 MM", kInk);
  }
  DrawBar(
      LeftOf(0), body_C, body_C + kThetaShown, {45, 60, 80, 100}, "C",
      [&](float celsius) { return Heat(celsius - body_C); }, canvas);
  DrawBar(
      LeftOf(2), 0, 100 * shrink_max, {0, 50 * shrink_max, 100 * shrink_max}, "% SHRINK",
      [&](float percent) { return Mix(kEdge, kShrunk, percent / (100 * shrink_max)); }, canvas);
  int x = LeftOf(1);
  const std::array<std::pair<const char*, Rgb>, 6> kinds{
      {{"WHOLE", kTissue}, {"DEAD", kDead}, {"BROWN", kBrown}, {"DRY", kDry}, {"CHAR", kChar}, {"HOLE", kHole}}};
  for (const auto& [name, colour] : kinds) {
    const int width = static_cast<int>(std::string_view(name).size() * Canvas::kLetterWidth);
    canvas->Box(x, kLegend - 7, x + width, kLegend + 5, kInk);
    canvas->Box(x + 1, kLegend - 6, x + width - 1, kLegend + 4, colour);
    canvas->Text(x, kLegend + 9, name, kInk);
    x += width + 24;
  }
}

}  // namespace

void WritePicture(const ThermalSolver& solver, const SceneView& scene, const Vec2f& centre, float width_m,
                  const std::filesystem::path& file) {
  const Frame frame{centre, width_m};
  Canvas canvas(kWidth, kHeight, kPaper);
  DrawCells(solver.field(), frame, &canvas);
  DrawMesh(scene, solver.topology().committed(), scene.thermal.shrink_max, frame, &canvas);
  DrawLegends(solver.field().material().body_C, scene.thermal.shrink_max, width_m, &canvas);
  canvas.WritePng(file);
}

}  // namespace fulcrum::thermal
