#include "services/scene/compiler/sheet_grid.h"

#include <cmath>
#include <cstdio>

#include "services/scene/compiler/spot.h"

namespace fulcrum::scene {
namespace {

constexpr double kLeastNormalAgreement = 0.05;  ///< Cosine between neighbouring normals: a smaller one means a fold.

}  // namespace

std::vector<Vec3d> Resample(const std::vector<Vec3d>& line, int count) {
  std::vector<double> length{0};
  for (std::size_t i = 1; i < line.size(); ++i) {
    length.push_back(length.back() + (line[i] - line[i - 1]).norm());
  }
  std::vector<Vec3d> result;
  std::size_t k = 0;
  for (int i = 0; i < count; ++i) {
    const double wanted = length.back() * i / (count - 1);
    while (k + 2 < length.size() && length[k + 1] < wanted) {
      ++k;
    }
    const double f = std::clamp((wanted - length[k]) / (length[k + 1] - length[k]), 0.0, 1.0);
    result.push_back((1 - f) * line[k] + f * line[k + 1]);
  }
  return result;
}

Vec3d NormalAt(const SheetGrid& sheet, int r, int c) {
  const Vec3d across = sheet.at(r, std::min(c + 1, sheet.cols - 1)) - sheet.at(r, std::max(c - 1, 0));
  const Vec3d along = sheet.at(std::min(r + 1, sheet.rows - 1), c) - sheet.at(std::max(r - 1, 0), c);
  return across.cross(along).normalized();
}

void PushOut(const TriangleMesh& organ, const TriangleLocator& locator, double reach,
             const std::function<double(int, int)>& least_gap, SheetGrid* sheet) {
  for (int r = 0; r < sheet->rows; ++r) {
    for (int c = 0; c < sheet->cols; ++c) {
      Vec3d& p = sheet->at(r, c);
      const auto hit = locator.Closest(p, reach);
      if (hit.triangle == kNoIndex) {
        continue;
      }
      const Triangle& t = organ.triangles[hit.triangle];
      const Vec3d &a = organ.vertices[t[0]], &b = organ.vertices[t[1]], &d = organ.vertices[t[2]];
      const Vec3d normal = (b - a).cross(d - a).normalized();
      const double height = normal.dot(p - hit.closest.point);
      const double distance = std::copysign(hit.closest.distance, height);
      const double least = least_gap(r, c);
      if (distance < least) {
        p += (least - distance) * normal;
      }
    }
  }
}

void Spread(SheetGrid* sheet) {
  std::vector<Vec3d> line;
  for (int r = 0; r < sheet->rows; ++r) {
    line.assign(sheet->values.begin() + static_cast<std::ptrdiff_t>(r) * sheet->cols,
                sheet->values.begin() + static_cast<std::ptrdiff_t>(r + 1) * sheet->cols);
    line = Resample(line, sheet->cols);
    std::copy(line.begin(), line.end(), sheet->values.begin() + static_cast<std::ptrdiff_t>(r) * sheet->cols);
  }
  for (int c = 0; c < sheet->cols; ++c) {
    line.clear();
    for (int r = 0; r < sheet->rows; ++r) {
      line.push_back(sheet->at(r, c));
    }
    line = Resample(line, sheet->rows);
    for (int r = 0; r < sheet->rows; ++r) {
      sheet->at(r, c) = line[r];
    }
  }
}

std::optional<std::pair<int, int>> FoldOf(const SheetGrid& sheet, const std::function<Vec3d(int)>& up) {
  for (int r = 0; r < sheet.rows; ++r) {
    for (int c = 0; c < sheet.cols; ++c) {
      const Vec3d normal = NormalAt(sheet, r, c);
      const bool outward = c != sheet.cols / 2 || normal.dot(up(r)) > kLeastNormalAgreement;
      if (!outward || !(normal.dot(NormalAt(sheet, r, std::min(c + 1, sheet.cols - 1))) > kLeastNormalAgreement) ||
          !(normal.dot(NormalAt(sheet, std::min(r + 1, sheet.rows - 1), c)) > kLeastNormalAgreement)) {
        return std::pair(r, c);
      }
    }
  }
  return std::nullopt;
}

void CheckFolds(const SheetGrid& sheet, const TriangleMesh& organ, const std::function<Vec3d(int)>& up,
                const std::string& name, const std::string& advice) {
  if (const auto fold = FoldOf(sheet, up)) {
    char text[160];
    const Vec3d& p = sheet.at(fold->first, fold->second);
    std::snprintf(text, sizeof(text), ": the membrane folds over at row %d, column %d, (%.1f, %.1f, %.1f) mm. ",
                  fold->first, fold->second, 1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z());
    throw SpotError(name + text + advice, {{organ, {sheet.values, GridTriangles(sheet.rows, sheet.cols)}}, p});
  }
}

}  // namespace fulcrum::scene
