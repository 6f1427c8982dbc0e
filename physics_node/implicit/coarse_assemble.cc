// How the next coarse matrix is added up, some rows of the membrane a step.
#include <algorithm>

#include "physics_node/implicit/coarse_row.h"
#include "physics_node/implicit/coarse_space.h"

namespace fulcrum::physics::implicit {
namespace {

/// Rows of the membrane, and afterwards columns of blocks of the factor, that one step adds to the next matrix.
/// Complete every 60 steps instead of every 30, the error of a pull was two thirds larger
/// (deploy/docs/measurements/physics).
constexpr int kRowsPerStep = 14, kFactorColumnsPerStep = 4;
/// Part of the mean diagonal that is added to it: nodes of little support must not make the matrix singular. Some
/// hundred times the rounding of a float. Assumed.
constexpr float kRegularisation = 1e-5f;

}  // namespace

void CoarseSpace::AddSheetRow(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int row) {
  const std::size_t stride = layout_.stride, start = static_cast<std::size_t>(row) * stride;
  const std::uint32_t cols = layout_.cols;
  const auto value = [&](const float* plane, std::uint32_t col) { return plane[start + layout_.Offset(0, col)]; };
  const CellPlace here = grid_.row_place[static_cast<std::size_t>(row)];
  const float next_row =
      row + 1 < sheet_rows_ ? here.fraction + grid_.row_step[static_cast<std::size_t>(row)] : here.fraction;
  const CoarseGrid::Columns& columns = grid_.sheets[grid_.sheet_of[static_cast<std::size_t>(row)]];
  CoarseRow sums(here.fraction, next_row, columns.step, &matrix_.next);
  int cell = 0;
  sums.Begin(grid_.NodesOf(here.cell, cell));
  for (std::uint32_t col = 0; col < cols; ++col) {
    const CellPlace at = columns.place[col];
    if (at.cell != cell) {
      sums.End();
      cell = at.cell;
      sums.Begin(grid_.NodesOf(here.cell, cell));
    }
    const bool moves = value(sheet.w, col) > 0.0f;
    if (moves) {
      const float mass = value(sheet.mass, col) * inertia;
      sums.Add(CoarseRow::kMass, {mass, mass, mass, 0, 0, 0}, at.fraction);
    }
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t down = d != 0 ? stride : 0;
      const std::uint32_t to = d != 1 ? col + 1 : col;
      if (to >= cols || (down && row + 1 >= sheet_rows_) || !(value(sheet.whole[d], col) > 0.0f)) {
        continue;
      }
      float e[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float* x = matrix.point[axis] + start;
        e[axis] = x[down + layout_.Offset(0, to)] - x[layout_.Offset(0, col)];
      }
      const float k = value(matrix.kt[d], col), along = value(matrix.along[d], col);
      const Symmetric element{k + along * e[0] * e[0], k + along * e[1] * e[1], k + along * e[2] * e[2],
                              along * e[0] * e[1],     along * e[0] * e[2],     along * e[1] * e[2]};
      const bool far_moves = sheet.w[start + down + layout_.Offset(0, to)] > 0.0f;
      if (moves && far_moves) {
        sums.Add(d, element, at.fraction);
      } else if (moves) {
        sums.AddNearEnd(element, at.fraction);
      } else if (far_moves) {
        sums.AddFarEnd(d, element, at.fraction);
      }
    }
  }
  sums.End();
}

void CoarseSpace::AddRows(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int rows) {
  if (matrix_.next_row == 0) {
    matrix_.next = matrix_.constant + inertia * matrix_.tube_mass;
  }
  for (const int end = std::min(matrix_.next_row + rows, sheet_rows_); matrix_.next_row < end; ++matrix_.next_row) {
    AddSheetRow(sheet, matrix, inertia, matrix_.next_row);
  }
  matrix_.complete = matrix_.next_row == sheet_rows_;
  if (matrix_.complete) {
    matrix_.next_row = 0;
    matrix_.next.diagonal().array() += kRegularisation * matrix_.next.diagonal().mean();
  }
}

void CoarseSpace::Assemble(const Sheet& sheet, const SheetMatrix& matrix, float inertia) {
  matrix_.next_row = 0;
  AddRows(sheet, matrix, inertia, sheet_rows_);
  (void)matrix_.factor.Take(kernels_, matrix_.next);
  matrix_.complete = false;
}

void CoarseSpace::AssembleNextPart(const Sheet& sheet, const SheetMatrix& matrix, float inertia) {
  if (matrix_.complete) {
    // When it is refused, the last factor stays in force.
    matrix_.complete =
        matrix_.factor.Continue(kernels_, matrix_.next, kFactorColumnsPerStep) == CoarseFactor::Progress::kMore;
  } else {
    AddRows(sheet, matrix, inertia, kRowsPerStep);
  }
}

}  // namespace fulcrum::physics::implicit
