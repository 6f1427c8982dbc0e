#include "services/scene/compiler/preview.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"
#include "services/base/picture/solid_view.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/placement.h"

namespace fulcrum::scene {
namespace {

using picture::Canvas;
using picture::Rgb;
using picture::SolidView;

constexpr int kWidth = 640, kHeight = 480, kGap = 4;
constexpr Rgb kPaper{250, 250, 248}, kInk{30, 36, 44}, kFixed{150, 146, 150}, kMembrane{240, 214, 150},
    kGrid{176, 142, 74}, kAround{196, 202, 210}, kUreter{70, 120, 220}, kNerve{240, 200, 40}, kMark{214, 0, 90};
constexpr std::array<Rgb, kMaxTools> kToolColours = {Rgb{20, 110, 200}, Rgb{20, 140, 70}, Rgb{150, 60, 170},
                                                     Rgb{120, 90, 40}};
/// By SolidLook: bowel, bladder, liver, gallbladder, fat, muscle, artery, vein, ureter, nerve.
constexpr std::array<Rgb, kSolidLooks> kSolidColours = {
    Rgb{214, 128, 112}, Rgb{228, 176, 150}, Rgb{150, 74, 62}, Rgb{150, 176, 110}, Rgb{236, 206, 110},
    Rgb{184, 84, 76},   Rgb{206, 44, 40},   Rgb{92, 84, 160}, Rgb{222, 196, 172}, Rgb{240, 226, 170}};
/// A line on a surface is seen although it lies within this depth behind it.
constexpr double kSlack_m = 0.0008;
constexpr double kFill = 0.85;  ///< Share of a view that the organ takes up.

std::vector<Vec3d> Doubles(std::span<const Vec3f> points) {
  std::vector<Vec3d> result;
  for (const Vec3f& p : points) result.push_back(p.cast<double>());
  return result;
}

struct Bounds {
  Vec3d low = Vec3d::Constant(1e9), high = Vec3d::Constant(-1e9);
  void Add(const Vec3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  [[nodiscard]] Vec3d middle() const { return 0.5 * (low + high); }
};

/// Size of a pixel at which everything between the bounds is seen.
double PixelFor(const Bounds& bounds, const Vec3d& right, const Vec3d& up) {
  const Vec3d half = 0.5 * (bounds.high - bounds.low);
  return std::max(right.cwiseAbs().dot(half) / (0.5 * kFill * kWidth),
                  up.cwiseAbs().dot(half) / (0.5 * kFill * kHeight));
}

struct Direction {
  const char* label;
  Vec3d right, up;
};

/// Four boxes with views, drawn by `draw(view, index)`.
template <class Draw>
std::string FourViews(const std::array<Direction, 4>& directions, const std::array<Bounds, 4>& bounds,
                      const Draw& draw) {
  Canvas canvas(2 * kWidth + kGap, 2 * kHeight + kGap, kInk);
  for (int i = 0; i < 4; ++i) {
    const int x = (i % 2) * (kWidth + kGap), y = (i / 2) * (kHeight + kGap);
    canvas.Box(x, y, x + kWidth, y + kHeight, kPaper);
    const Direction& d = directions[static_cast<std::size_t>(i)];
    const Bounds& b = bounds[static_cast<std::size_t>(i)];
    SolidView view(x, y, x + kWidth, y + kHeight, b.middle(), d.right, d.up, PixelFor(b, d.right, d.up), &canvas);
    draw(&view, i);
    view.Label(d.label, kInk);
    view.Scale(kInk);
  }
  return canvas.Png();
}

class ScenePainter {
 public:
  explicit ScenePainter(const SceneView& scene)
      : scene_(scene), rest_(Doubles(scene.rest_position)), around_(Doubles(scene.static_vertices)) {
    const std::vector<Index> solid = SolidOfVertices(scene);
    for (const Triangle& t : scene.tube_surface) {
      const bool is_fixed = std::all_of(t.begin(), t.end(), [&](Index v) { return scene.inverse_mass[v] == 0; });
      const SolidLook look = scene.solids.empty() ? SolidLook::kBowel : scene.solids[solid[t[0]]].look;
      (is_fixed ? fixed_ : free_[static_cast<std::size_t>(look)]).push_back(t);
    }
    for (const SheetPart& sheet : SheetsOf(scene)) {
      for (Triangle t : GridTriangles(static_cast<int>(sheet.rows), static_cast<int>(sheet.cols))) {
        for (Index& v : t) v = NodeOf(sheet, static_cast<int>(v / sheet.cols), static_cast<int>(v % sheet.cols));
        membrane_.push_back(t);
      }
    }
    for (const Vec3d& p : rest_) bounds_.Add(p);
  }

  [[nodiscard]] const Bounds& bounds() const { return bounds_; }

  void Paint(SolidView* view) const {
    view->Solid(rest_, membrane_, kMembrane, true);
    for (std::size_t look = 0; look < free_.size(); ++look) view->Solid(rest_, free_[look], kSolidColours[look], false);
    view->Solid(rest_, fixed_, kFixed, false);
    for (const StaticSurface& s : scene_.static_surfaces) {
      if (std::string_view(s.name) == "cavity") continue;  // Around everything.
      view->Solid(around_, scene_.static_triangles.subspan(s.first_triangle, s.triangle_count), kAround, false);
    }
    for (const SheetPart& sheet : SheetsOf(scene_)) PaintGrid(sheet, view);
    for (const ProtectedStructure& s : scene_.protected_structures) {
      for (Index i = s.first_point; i + 1 < s.first_point + s.point_count; ++i) {
        view->Line(scene_.protected_points[i].p_W.cast<double>(), scene_.protected_points[i + 1].p_W.cast<double>(), 3,
                   s.kind == ProtectedKind::kUreter ? kUreter : kNerve, 1);
      }
    }
    PaintTools(view);
  }

 private:
  /// The particle of a node of a sheet.
  [[nodiscard]] Index NodeOf(const SheetPart& sheet, int row, int col) const {
    return scene_.membrane.first + (sheet.first_row + static_cast<Index>(row)) * scene_.membrane.cols +
           static_cast<Index>(col);
  }

  void PaintGrid(const SheetPart& sheet, SolidView* view) const {
    constexpr int kLines = 12;
    const auto rows = static_cast<int>(sheet.rows), cols = static_cast<int>(sheet.cols);
    const auto node = [&](int r, int c) { return rest_[NodeOf(sheet, r, c)]; };
    for (int k = 0; k <= kLines; ++k) {
      const int r = k * (rows - 1) / kLines, c = k * (cols - 1) / kLines;
      for (int i = 0; i + 1 < cols; ++i) view->Line(node(r, i), node(r, i + 1), 1, kGrid, kSlack_m);
      for (int i = 0; i + 1 < rows; ++i) view->Line(node(i, c), node(i + 1, c), 1, kGrid, kSlack_m);
    }
  }

  /// The path of each tip, and its shaft where the tool is half way through its script.
  void PaintTools(SolidView* view) const {
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      const ToolDescription& description = scene_.tools[tool];
      if (description.kind == ToolKind::kNone || description.kind == ToolKind::kScope) continue;
      const ScriptKey* last = nullptr;
      const ScriptKey* middle = nullptr;
      for (const ScriptKey& key : scene_.script) {
        if (key.tool != tool) continue;
        if (last != nullptr) {
          view->Line(last->p_W.cast<double>(), key.p_W.cast<double>(), 2, kToolColours[tool], 1);
        }
        last = &key;
        if (key.time_s <= 0.5f * scene_.script_duration_s) middle = &key;
      }
      if (middle != nullptr) {
        view->Line(description.p_WP.cast<double>(), middle->p_W.cast<double>(), 4, kToolColours[tool], kSlack_m);
      }
    }
  }

  const SceneView& scene_;
  std::vector<Vec3d> rest_, around_;
  std::array<std::vector<Triangle>, kSolidLooks> free_;  ///< By look.
  std::vector<Triangle> fixed_, membrane_;
  Bounds bounds_;
};

}  // namespace

std::string PreviewOf(const SceneView& scene) {
  const ScenePainter painter(scene);
  const Vec3d eye = (scene.render.scope_tip_W - scene.render.scope_target_W).cast<double>().normalized();
  const Vec3d right =
      Vec3d(Vec3d::UnitZ().cross(eye).norm() > 1e-3 ? Vec3d::UnitZ().cross(eye) : Vec3d::UnitX()).normalized();
  const std::array<Direction, 4> directions = {Direction{"as the scope sees it", right, eye.cross(right)},
                                               Direction{"from above (z)", Vec3d::UnitX(), Vec3d::UnitY()},
                                               Direction{"from the patient's left (x)", Vec3d::UnitY(), Vec3d::UnitZ()},
                                               Direction{"from caudal (-y)", Vec3d::UnitX(), Vec3d::UnitZ()}};
  const Bounds& b = painter.bounds();
  return FourViews(directions, {b, b, b, b}, [&](SolidView* view, int) { painter.Paint(view); });
}

std::string PictureOf(const Spot& spot) {
  Bounds whole, near;
  for (const TriangleMesh& mesh : spot.meshes) {
    for (const Vec3d& p : mesh.vertices) whole.Add(p);
  }
  const double reach = 0.12 * (whole.high - whole.low).maxCoeff();
  near.Add(spot.place - Vec3d::Constant(reach));
  near.Add(spot.place + Vec3d::Constant(reach));
  // From the side on which the place lies.
  const Vec3d out = spot.place - whole.middle();
  const double side = out.z() < 0 ? -1 : 1;
  const Direction above{side > 0 ? "from above (z)" : "from below (-z)", side * Vec3d::UnitX(), Vec3d::UnitY()};
  const bool caudal = out.y() < 0;
  const Direction beside{caudal ? "from -y" : "from y", (caudal ? 1.0 : -1.0) * Vec3d::UnitX(), Vec3d::UnitZ()};
  Direction above_near = above, beside_near = beside;
  above_near.label = beside_near.label = "close";
  return FourViews({above, beside, above_near, beside_near}, {whole, whole, near, near}, [&](SolidView* view, int i) {
    for (std::size_t m = 0; m < spot.meshes.size(); ++m) {
      view->Solid(spot.meshes[m].vertices, spot.meshes[m].triangles, m == 0 ? kSolidColours[0] : kMembrane, true);
      if (i < 2) continue;
      for (const Triangle& t : spot.meshes[m].triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
          view->Line(spot.meshes[m].vertices[t[k]], spot.meshes[m].vertices[t[(k + 1) % 3]], 1, kInk, 0.02 * reach);
        }
      }
    }
    view->Ring(spot.place, i < 2 ? 24 : 48, kMark);
  });
}

}  // namespace fulcrum::scene
