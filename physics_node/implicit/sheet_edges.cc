#include "physics_node/implicit/sheet_edges.h"

#include <algorithm>

#include "physics_node/energy/triangle_energy.h"

namespace fulcrum::physics::implicit {
namespace {

/// Lost edges from which on a node is frayed, of six: the border of a clean cut loses two.
constexpr int kFrayedEdges = 3;
/// Stiffness of a frayed node's edges in every direction, in the matrix only, over that along them. Of 0, 2, 5, 20 and
/// 50 % this one evaluated the energy least often (deploy/docs/measurements/physics, Shreds).
constexpr float kFrayedStiffness = 0.05f;

}  // namespace

SheetEdges::SheetEdges(const ImplicitModel& model, const TissueModel& tissue) : model_(model) {
  const std::size_t plane = model.layout.plane;
  for (std::size_t d = 0; d < 3; ++d) {
    axial_[d] = FloatArray(plane);
    inverse_rest_[d] = FloatArray(plane);
    std::copy_n(model.sheet.axial[d].data(), plane, axial_[d].data());
    std::copy_n(model.sheet.inverse_rest[d].data(), plane, inverse_rest_[d].data());
  }
  missing_.assign(plane, 0);
  frayed_nodes_.reserve(plane);
  frayed_edges_.reserve(3 * plane);  // A frayed node has at most three edges left.
  if (model.sheet.continuum) {
    for (std::size_t half = 0; half < 2; ++half) {
      triangle_[half] = FloatArray(plane);
      for (FloatArray& trace : trace_[half]) {
        trace = FloatArray(plane);
      }
    }
    for (std::size_t d = 0; d < 3; ++d) {
      spring_[d] = FloatArray(plane);
    }
    springs_in_row_.assign(model.grid.rows, 0);
  }
  for (std::uint32_t row = 0; row < model.grid.rows; ++row) {
    for (std::uint32_t col = 0; col < model.grid.cols; ++col) {
      for (std::size_t d = 0; d < 3; ++d) {
        Update(tissue, row, col, d);
      }
    }
  }
}

Sheet SheetEdges::View(const float* inverse_mass) const {
  const bool continuum = model_.sheet.continuum;
  const std::array<FloatArray, 3>& springs = continuum ? spring_ : axial_;
  const auto trace = [&](std::size_t half, std::size_t i) { return trace_[half][i].data(); };
  return {model_.layout.rows,
          model_.layout.slots,
          {inverse_rest_[0].data(), inverse_rest_[1].data(), inverse_rest_[2].data()},
          {springs[0].data(), springs[1].data(), springs[2].data()},
          {axial_[0].data(), axial_[1].data(), axial_[2].data()},
          model_.sheet.stiffening,
          {continuum ? triangle_[0].data() : nullptr, continuum ? triangle_[1].data() : nullptr},
          {{trace(0, 0), trace(0, 1), trace(0, 2)}, {trace(1, 0), trace(1, 1), trace(1, 2)}},
          model_.sheet.triangle_stiffening,
          springs_in_row_.data(),
          inverse_mass,
          model_.sheet.mass.data()};
}

void SheetEdges::Update(const TissueModel& tissue, Index row, Index col, std::size_t direction) {
  const GridLayout& grid = model_.grid;
  const std::uint32_t at = grid.Offset(row, col);
  const float rest = tissue.rest(static_cast<int>(direction))[at], before = axial_[direction][at];
  axial_[direction][at] = rest > 0.0f ? model_.sheet.axial[direction][at] : 0.0f;
  if (rest > 0.0f) {
    inverse_rest_[direction][at] = 1.0f / (rest * model_.sheet.rest_scale);
  }
  if ((before > 0.0f) != (axial_[direction][at] > 0.0f)) {
    const int missing = before > 0.0f ? 1 : -1;
    missing_[at] += missing;
    missing_[grid.Offset(row + (direction != 0 ? 1 : 0), col + (direction != 1 ? 1 : 0))] += missing;
  }
  if (model_.sheet.continuum) {
    for (const std::optional<TrianglePlace>& triangle : TrianglesOf(row, col, direction)) {
      if (triangle) {
        UpdateTriangle(*triangle);
      }
    }
    UpdateSpring(row, col, direction);
  }
}

/// The two triangles of an edge; none beyond the rim of its sheet.
std::array<std::optional<SheetEdges::TrianglePlace>, 2> SheetEdges::TrianglesOf(Index row, Index col,
                                                                                std::size_t direction) const {
  const auto place = [&](bool exists, Index r, Index c, std::size_t half) {
    const bool is_cell = exists && r + 1 < model_.grid.rows && c + 1 < model_.grid.cols &&
                         model_.sheet.axial[2][model_.grid.Offset(r, c)] > 0.0f;
    return is_cell ? std::optional(TrianglePlace{r, c, half}) : std::nullopt;
  };
  switch (direction) {
    case 0:
      return {place(true, row, col, 0), place(row > 0, row - 1, col, 1)};
    case 1:
      return {place(true, row, col, 1), place(col > 0, row, col - 1, 0)};
    default:
      return {place(true, row, col, 0), place(true, row, col, 1)};
  }
}

void SheetEdges::UpdateTriangle(const TrianglePlace& triangle) {
  const GridLayout& grid = model_.grid;
  const Index down = triangle.half == 1 ? 1 : 0, right = triangle.half == 0 ? 1 : 0;
  const std::array<std::array<Index, 2>, 3> owner{
      {{triangle.row + down, triangle.col}, {triangle.row, triangle.col + right}, {triangle.row, triangle.col}}};
  const std::uint32_t at = grid.Offset(triangle.row, triangle.col);
  std::array<double, 3> lengths{};
  bool whole = true;
  for (std::size_t d = 0; d < 3; ++d) {
    const std::uint32_t edge = grid.Offset(owner[d][0], owner[d][1]);
    whole = whole && axial_[d][edge] > 0.0f;
    lengths[d] = 1.0 / static_cast<double>(inverse_rest_[d][edge]);
  }
  const TriangleRest rest =
      whole ? RestOfTriangle(lengths, static_cast<double>(model_.sheet.Et[triangle.row])) : TriangleRest{};
  triangle_[triangle.half][at] = static_cast<float>(rest.stiffness);
  for (std::size_t d = 0; d < 3; ++d) {
    trace_[triangle.half][d][at] = static_cast<float>(rest.trace[d]);
    UpdateSpring(owner[d][0], owner[d][1], d);
  }
}

void SheetEdges::UpdateSpring(Index row, Index col, std::size_t direction) {
  const std::uint32_t at = model_.grid.Offset(row, col);
  float triangles = 0, open = 0;
  for (const std::optional<TrianglePlace>& triangle : TrianglesOf(row, col, direction)) {
    if (triangle) {
      triangles += 1;
      open += triangle_[triangle->half][model_.grid.Offset(triangle->row, triangle->col)] > 0.0f ? 0 : 1;
    }
  }
  float& spring = spring_[direction][at];
  const bool before = spring > 0.0f;
  spring = triangles > 0 ? axial_[direction][at] * open / triangles : axial_[direction][at];
  if (before != (spring > 0.0f)) {
    springs_in_row_[row] += before ? -1 : 1;
  }
}

void SheetEdges::FindFrayed() {
  const GridLayout& grid = model_.grid;
  frayed_nodes_.clear();
  frayed_edges_.clear();
  const auto add = [&](std::size_t direction, std::uint32_t at, std::uint32_t far_end) {
    const float along = axial_[direction][at] * inverse_rest_[direction][at];
    if (along > 0.0f) {
      frayed_edges_.push_back({direction, {at, far_end}, kFrayedStiffness * along});
    }
  };
  for (std::uint32_t at = 0; at < missing_.size(); ++at) {
    if (missing_[at] < kFrayedEdges) {
      continue;
    }
    frayed_nodes_.push_back({static_cast<std::uint32_t>(model_.layout.tube_floats) + at, grid.plane()});
    const Index row = grid.RowAt(at), col = grid.ColAt(at);
    for (std::size_t d = 0; d < 3; ++d) {
      const Index down = d != 0 ? 1 : 0, right = d != 1 ? 1 : 0;
      if (row + down < grid.rows && col + right < grid.cols) {
        add(d, at, grid.Offset(row + down, col + right));
      }
      // An edge between two frayed nodes is added at the one that owns it.
      if (row >= down && col >= right && missing_[grid.Offset(row - down, col - right)] < kFrayedEdges) {
        add(d, grid.Offset(row - down, col - right), at);
      }
    }
  }
}

}  // namespace fulcrum::physics::implicit
