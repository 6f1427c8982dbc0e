// A sheet under construction: nodes on a regular grid, and the steps that every way of draping shares.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/scene/builder/geometry.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// Rows of values on a regular grid.
template <class T>
struct Grid {
  int rows, cols;
  std::vector<T> values;

  Grid(int r, int c, const T& value) : rows(r), cols(c), values(static_cast<std::size_t>(r) * c, value) {}
  T& at(int r, int c) { return values[static_cast<std::size_t>(r) * cols + c]; }
  const T& at(int r, int c) const { return values[static_cast<std::size_t>(r) * cols + c]; }

  /// Bilinear at fractions in [0, 1].
  [[nodiscard]] T Sample(double row, double col) const {
    const double y = row * (rows - 1), x = col * (cols - 1);
    const int r = std::clamp(static_cast<int>(y), 0, rows - 2), c = std::clamp(static_cast<int>(x), 0, cols - 2);
    const double v = y - r, u = x - c;
    return (1 - v) * ((1 - u) * at(r, c) + u * at(r, c + 1)) + v * ((1 - u) * at(r + 1, c) + u * at(r + 1, c + 1));
  }

  /// Moves each value half way to the mean of its neighbours, `times` times. Border values have fewer neighbours, or
  /// are kept.
  void Smooth(int times, bool keep_border) {
    for (int k = 0; k < times; ++k) {
      const Grid old = *this;
      for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < cols; ++c) {
          if (keep_border && (r == 0 || c == 0 || r == rows - 1 || c == cols - 1)) {
            continue;
          }
          T sum = old.at(std::max(r - 1, 0), c);
          sum += old.at(std::min(r + 1, rows - 1), c);
          sum += old.at(r, std::max(c - 1, 0));
          sum += old.at(r, std::min(c + 1, cols - 1));
          at(r, c) = 0.5 * old.at(r, c) + 0.125 * sum;
        }
      }
    }
  }
};

using SheetGrid = Grid<Vec3d>;

/// `count` equally spaced points along a polyline.
std::vector<Vec3d> Resample(const std::vector<Vec3d>& line, int count);

/// Unit normal at a node, (column direction) x (row direction).
Vec3d NormalAt(const SheetGrid& sheet, int r, int c);

/// Moves nodes that are nearer to the organ than `least_gap(row, column)` outwards along the surface's normal.
void PushOut(const TriangleMesh& organ, const TriangleLocator& locator, double reach,
             const std::function<double(int, int)>& least_gap, SheetGrid* sheet);

/// Spaces the nodes evenly along each row, then along each column.
void Spread(SheetGrid* sheet);

/// A node beside a fold, which is a crease of more than 90 degrees between neighbouring nodes, or where the middle of
/// row r does not face `up(r)`; row and column.
std::optional<std::pair<int, int>> FoldOf(const SheetGrid& sheet, const std::function<Vec3d(int)>& up);

/// Throws SpotError "name: ..., advice" at a fold.
void CheckFolds(const SheetGrid& sheet, const TriangleMesh& organ, const std::function<Vec3d(int)>& up,
                const std::string& name, const std::string& advice);

}  // namespace fulcrum::scene
