#include "services/scene/builder/sheets.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "services/base/core/error.h"
#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"
#include "services/scene/builder/flatten.h"
#include "services/scene/builder/geometry.h"

namespace fulcrum::scene {
namespace {

constexpr double kAtlasMargin_m = 0.001;  ///< Smallest sheet coordinate, so that a patch has texels on all sides.
constexpr double kApart_m = 0.004;        ///< Between two sheets in the atlas: more than the heat of a burn spreads,
constexpr int kHeatTile = 32;             ///< … and than a tile of thermal_node, which has this many cells a side.
/// The place of each sheet in the atlas begins at a multiple of a patch, so that no patch shows two.
constexpr double kTexel_m = static_cast<double>(MembraneGrid().texel_m);
constexpr double kPatch_m = kPatchTexels * kTexel_m;

std::size_t NodeOf(const SheetBody& sheet, int row, int col) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(sheet.grid.cols) + static_cast<std::size_t>(col);
}

/// visit(node of the grid, number of the sheet, its row, its column, whether the node is the sheet's) for every node of
/// the grid; a node of no sheet comes with the nearest one of the sheet before it.
template <class Visit>
void ForEachNode(const std::vector<SheetPart>& parts, const MembraneGrid& grid, const Visit& visit) {
  std::size_t sheet = 0;
  for (std::uint32_t row = 0; row < grid.rows; ++row) {
    if (sheet + 1 < parts.size() && row >= parts[sheet + 1].first_row) ++sheet;
    const SheetPart& part = parts[sheet];
    const std::uint32_t own_row = std::min(row - part.first_row, part.rows - 1);
    for (std::uint32_t col = 0; col < grid.cols; ++col) {
      const std::uint32_t own_col = std::min(col, part.cols - 1);
      const bool is_own = row - part.first_row == own_row && col == own_col;
      visit(std::size_t{row} * grid.cols + col, sheet, static_cast<int>(own_row), static_cast<int>(own_col), is_own);
    }
  }
}

std::vector<double> MassesOf(const SheetBody& sheet) {
  std::vector<double> mass(sheet.nodes.size(), 0.0);
  for (int r = 0; r + 1 < sheet.grid.rows; ++r) {
    for (int c = 0; c + 1 < sheet.grid.cols; ++c) {
      const std::size_t n00 = NodeOf(sheet, r, c), n11 = NodeOf(sheet, r + 1, c + 1);
      for (const auto& t : {std::array{n00, n00 + 1, n11}, std::array{n00, n11, n11 - 1}}) {
        const Vec3d &a = sheet.nodes[t[0]], &b = sheet.nodes[t[1]], &d = sheet.nodes[t[2]];
        const double area = (b - a).cross(d - a).norm() / 2;
        for (const std::size_t v : t) mass[v] += sheet.grid.density_kg_m2 * area / 3;
      }
    }
  }
  return mass;
}

bool IsHeld(const SheetBody& sheet, int row, int col) {
  const bool is_end = row == 0 || row == sheet.grid.rows - 1, is_side = col == 0 || col == sheet.grid.cols - 1;
  return (is_end && sheet.ends_held) || (is_side && sheet.sides_held);
}

/// Places of rectangles in the atlas, from left to right in shelves.
class Shelves {
 public:
  explicit Shelves(double apart_m) : apart_m_(apart_m) {}

  Eigen::Vector2d Put(const Eigen::Vector2d& size, double width) {
    const auto patches = [this](double length) {
      return std::ceil((length + 2 * kAtlasMargin_m + apart_m_) / kPatch_m) * kPatch_m;
    };
    if (x_ > 0 && x_ + size.x() > width) {
      x_ = 0;
      y_ += height_;
      height_ = 0;
    }
    Eigen::Vector2d at(x_, y_);
    x_ += patches(size.x());
    height_ = std::max(height_, patches(size.y()));
    return at;
  }

 private:
  double apart_m_, x_ = 0, y_ = 0, height_ = 0;
};

}  // namespace

SheetBody MembraneOf(const SceneSettings& settings, std::vector<Vec3d> nodes) {
  SheetBody membrane;
  membrane.name = "membrane";
  membrane.grid = settings.membrane;
  membrane.nodes = std::move(nodes);
  membrane.over = 0;
  return membrane;
}

std::vector<SheetPart> PlaceSheets(const std::vector<SheetBody>& sheets) {
  std::vector<SheetPart> parts;
  std::uint32_t row = 0;
  for (const SheetBody& sheet : sheets) {
    SheetPart& part = parts.emplace_back();
    std::strncpy(part.name, sheet.name.c_str(), sizeof(part.name) - 1);
    part.first_row = row;
    part.rows = static_cast<std::uint32_t>(sheet.grid.rows);
    part.cols = static_cast<std::uint32_t>(sheet.grid.cols);
    part.over = sheet.over;
    part.Et_N_per_m = sheet.own.Et_N_per_m;
    part.bending_Nm = sheet.own.bending_Nm;
    part.fat_youngs_modulus_Pa = sheet.own.fat_youngs_modulus_Pa;
    part.tear_stretch = sheet.own.tear_stretch;
    part.thickness_m = sheet.heat.thickness_m;
    part.conductivity_W_mK = sheet.heat.conductivity_W_mK;
    part.sigma_S_m = sheet.heat.sigma_S_m;
    const std::uint32_t least = row + part.rows + kRowsBetweenSheets;
    row = (least + kRowsBetweenSheets - 1) / kRowsBetweenSheets * kRowsBetweenSheets;
  }
  return parts;
}

PlacedSheet::PlacedSheet(const SheetBody& body, const SheetPart& part, const MembraneGrid& grid,
                         const std::vector<Vec2f>& material)
    : body_(body), part_(part), cols_(grid.cols), material_(material) {}

PlacedSheet::Point PlacedSheet::At(double s, double t) const {
  const int rows = body_.grid.rows, cols = body_.grid.cols;
  const double x = std::clamp(s, 0.0, 1.0) * (cols - 1), y = std::clamp(t, 0.0, 1.0) * (rows - 1);
  const int c = std::min(static_cast<int>(x), cols - 2), r = std::min(static_cast<int>(y), rows - 2);
  const double u = x - c, v = y - r;
  const auto node = [&](int dr, int dc) -> const Vec3d& { return body_.nodes[NodeOf(body_, r + dr, c + dc)]; };
  const auto at = [&](int dr, int dc) -> const Vec2f& {
    return material_[(part_.first_row + static_cast<std::size_t>(r + dr)) * cols_ + static_cast<std::size_t>(c + dc)];
  };
  const Vec3d &p00 = node(0, 0), &p01 = node(0, 1), &p10 = node(1, 0), &p11 = node(1, 1);
  Point result;
  result.p = (1 - v) * ((1 - u) * p00 + u * p01) + v * ((1 - u) * p10 + u * p11);
  const Vec3d ds = (1 - v) * (p01 - p00) + v * (p11 - p10), dt = (1 - u) * (p10 - p00) + u * (p11 - p01);
  result.normal = ds.cross(dt).normalized();
  const auto fu = static_cast<float>(u), fv = static_cast<float>(v);
  result.material = (1 - fv) * ((1 - fu) * at(0, 0) + fu * at(0, 1)) + fv * ((1 - fu) * at(1, 0) + fu * at(1, 1));
  return result;
}

void AddSheetParticles(const std::vector<SheetBody>& sheets, const std::vector<SheetPart>& parts, SceneData* scene) {
  std::vector<std::vector<double>> mass;
  mass.reserve(sheets.size());
  for (const SheetBody& sheet : sheets) mass.push_back(MassesOf(sheet));
  ForEachNode(parts, scene->fixed.membrane, [&](std::size_t, std::size_t i, int row, int col, bool is_own) {
    const std::size_t node = NodeOf(sheets[i], row, col);
    scene->rest_position.push_back(sheets[i].nodes[node].cast<float>());
    const bool fixed = !is_own || IsHeld(sheets[i], row, col);
    if (!fixed && !(mass[i][node] > 0)) {
      throw InputError("scene '" + std::string(scene->fixed.name) + "': " + sheets[i].name + ": node " +
                       std::to_string(node) + " has no mass: the triangles around it have no area");
    }
    scene->inverse_mass.push_back(fixed ? 0.0f : static_cast<float>(1 / mass[i][node]));
  });
}

void AddSheetConstraints(const std::vector<SheetBody>& sheets, const std::vector<SheetPart>& parts, SceneData* scene) {
  const MembraneGrid& grid = scene->fixed.membrane;
  const auto x = [&](Index v) { return Vec3d(scene->rest_position[v].cast<double>()); };
  scene->membrane_rest_length.assign(3 * static_cast<std::size_t>(grid.node_count()), 0.0f);
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const int rows = sheets[i].grid.rows, cols = sheets[i].grid.cols;
    const auto node = [&](int r, int c) {
      return grid.first + (parts[i].first_row + static_cast<Index>(r)) * grid.cols + static_cast<Index>(c);
    };
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < cols; ++c) {
        constexpr int kStep[3][2] = {{0, 1}, {1, 0}, {1, 1}};
        for (Index k = 0; k < 3; ++k) {
          const int r2 = r + kStep[k][0], c2 = c + kStep[k][1];
          if (r2 < rows && c2 < cols) {
            scene->membrane_rest_length[3 * (node(r, c) - grid.first) + k] =
                static_cast<float>((x(node(r, c)) - x(node(r2, c2))).norm());
          }
        }
      }
    }
    const int dr = sheets[i].grid.bending_row_stride, dc = sheets[i].grid.bending_col_stride;
    const auto add = [&](Index v0, Index v1, Index v2, Index v3) {
      scene->bending.push_back({{v0, v1, v2, v3}, static_cast<float>(DihedralAngle(x(v0), x(v1), x(v2), x(v3)))});
    };
    //   n10 --- n11      interior edges of the coarse sheet: each cell's diagonal n00-n11; the edge n00-n01 where a
    //    |   /   |       row of cells lies below it; the edge n00-n10 where a column of cells lies to its left. The
    //   n00 --- n01      wings are chosen so that both normals point outward (s x t).
    for (int r = 0; r + dr < rows; r += dr) {
      for (int c = 0; c + dc < cols; c += dc) {
        add(node(r, c), node(r + dr, c + dc), node(r + dr, c), node(r, c + dc));
        if (r > 0) {
          add(node(r, c), node(r, c + dc), node(r + dr, c + dc), node(r - dr, c));
        }
        if (c > 0) {
          add(node(r, c), node(r + dr, c), node(r, c - dc), node(r + dr, c + dc));
        }
      }
    }
  }
}

void AddBindings(const SceneSettings& settings, const Anatomy& anatomy, const std::vector<SheetPart>& parts,
                 const std::vector<Vec3d>& vertices, SceneData* scene) {
  std::vector<Index> first_of{0};
  for (const SolidBody& body : anatomy.solids) {
    first_of.push_back(first_of.back() + static_cast<Index>(body.vertices.size()));
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const SheetBody& sheet = anatomy.sheets[k];
    const MembraneSettings& m = sheet.grid;
    std::vector<Triangle> surface;
    for (const Triangle& t : scene->tube_surface) {
      const bool is_of = sheet.over == kNoIndex || (t[0] >= first_of[sheet.over] && t[0] < first_of[sheet.over + 1]);
      if (is_of) surface.push_back(t);
    }
    const std::size_t before = scene->bindings.size();
    std::size_t candidates = 0;
    const TriangleLocator locator(vertices, surface);
    // Scenes of one membrane keep theirs.
    const bool is_membrane = settings.has_organ && k == 0;
    const int first_row = is_membrane ? m.binding_row_stride / 2 : (m.binding_row_stride - 1) / 2;
    const int first_col = is_membrane ? m.binding_col_stride / 2 + 1 : (m.binding_col_stride - 1) / 2;
    for (int r = first_row; r < m.rows && !surface.empty(); r += m.binding_row_stride) {
      for (int c = first_col; c < m.cols; c += m.binding_col_stride) {
        const Index particle = scene->fixed.membrane.first +
                               (parts[k].first_row + static_cast<Index>(r)) * scene->fixed.membrane.cols +
                               static_cast<Index>(c);
        if (scene->inverse_mass[particle] == 0) continue;
        ++candidates;
        const auto hit = locator.Closest(sheet.nodes[NodeOf(sheet, r, c)], m.binding_reach_m);
        if (hit.triangle == kNoIndex) continue;
        Binding binding{particle, surface[hit.triangle], {}, static_cast<float>(hit.closest.distance)};
        for (int i = 0; i < 3; ++i) {
          binding.barycentric[i] = static_cast<float>(hit.closest.barycentric[i]);
        }
        scene->bindings.push_back(binding);
      }
    }
    if (scene->bindings.size() == before && sheet.over != kNoIndex) {
      if (candidates == 0) {
        Refuse(settings, sheet.name + ": every node on the sub-grid of the bindings is fixed; lower its " +
                             "binding_row_stride or binding_col_stride, or give it more rows and columns");
      }
      std::ostringstream text;
      text << "no " << sheet.name << " node lies within binding_reach = " << 1e3 * m.binding_reach_m << " mm of the "
           << anatomy.solids[sheet.over].name;
      Refuse(settings, text.str());
    }
  }
}

std::vector<Vec2f> SheetMaterial(const SceneSettings& settings, const std::vector<SheetBody>& sheets,
                                 const std::vector<SheetPart>& parts, const MembraneGrid& grid) {
  const double limit = kAtlasTexels * kTexel_m - 2 * kAtlasMargin_m;
  std::vector<std::vector<Eigen::Vector2d>> flat;
  std::vector<Eigen::Vector2d> at;
  Shelves shelves(std::max(kApart_m, kHeatTile * static_cast<double>(settings.thermal.cell_m)));
  for (const SheetBody& sheet : sheets) {
    flat.push_back(FlattenSheet(sheet.grid.rows, sheet.grid.cols, sheet.nodes));
    Eigen::Vector2d extent = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& m : flat.back()) {
      if (!m.allFinite()) {
        Refuse(settings, "the " + sheet.name + " cannot be flattened: it has degenerate triangles");
      }
      extent = extent.cwiseMax(m);
    }
    at.push_back(shelves.Put(extent, limit));
    if ((extent + at.back()).maxCoeff() > limit) {
      std::ostringstream text;
      text << "the " << sheet.name << " is " << 1e3 * extent.x() << " x " << 1e3 * extent.y()
           << " mm when flattened; valid: at most " << 1e3 * limit << " mm either way (the atlas)";
      if (sheets.size() > 1) text << ", and room beside the sheets before it";
      Refuse(settings, text.str());
    }
  }
  std::vector<Vec2f> material;
  material.reserve(grid.node_count());
  ForEachNode(parts, grid, [&](std::size_t, std::size_t i, int row, int col, bool) {
    const Eigen::Vector2d& m = flat[i][NodeOf(sheets[i], row, col)];
    material.push_back((m + (at[i] + Eigen::Vector2d::Constant(kAtlasMargin_m))).cast<float>());
  });
  return material;
}

}  // namespace fulcrum::scene
