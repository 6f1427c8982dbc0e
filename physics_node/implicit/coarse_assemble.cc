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

/// Between two solids: weights of the coarse nodes first, since the corners of a triangle mostly share theirs. The
/// solids' part of the matrix is that at rest. As far as they have turned it is too soft in some directions, and with
/// the slides' normals alone they swing on (deploy/docs/measurements/physics, Sliding solids): across the normal a
/// slide then counts in part.
void CoarseSpace::AddSlide(const Element& slide, float turned) {
  std::array<std::pair<std::uint16_t, float>, kCellCorners * 4> weights;
  std::size_t count = 0;
  for (std::size_t k = 0; k < slide.at.size(); ++k) {
    const LatticePlace& place = grid_.tube_weights[slide.at[k].base / kVertexFloats];
    for (std::size_t corner = 0; corner < kCellCorners; ++corner) {
      const auto end = weights.begin() + static_cast<std::ptrdiff_t>(count);
      const auto at = std::find_if(weights.begin(), end, [&](const auto& w) { return w.first == place.node[corner]; });
      if (at == end) weights[count++] = {place.node[corner], 0.0f};
      at->second += slide.weight[k] * place.weight[corner];
    }
  }
  const float normal = slide.m.squaredNorm();
  const Eigen::Matrix3f stiffness =
      (slide.kt + turned * normal) * Eigen::Matrix3f::Identity() + (1 - turned) * slide.m * slide.m.transpose();
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = 0; b < count; ++b) {
      matrix_.next.block<3, 3>(3 * weights[a].first, 3 * weights[b].first) +=
          weights[a].second * weights[b].second * stiffness;
    }
  }
}

void CoarseSpace::AddRows(const Sheet& sheet, const SheetMatrix& matrix, float inertia, const Slides& slides,
                          int rows) {
  if (matrix_.next_row == 0) {
    matrix_.next = matrix_.constant + inertia * matrix_.tube_mass;
    for (std::size_t i = 0; i < slides.elements().size(); ++i) AddSlide(slides.elements()[i], slides.turned()[i]);
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

void CoarseSpace::Assemble(const Sheet& sheet, const SheetMatrix& matrix, float inertia, const Slides& slides) {
  matrix_.next_row = 0;
  AddRows(sheet, matrix, inertia, slides, sheet_rows_);
  (void)matrix_.factor.Take(kernels_, matrix_.next);
  matrix_.complete = false;
}

void CoarseSpace::AssembleNextPart(const Sheet& sheet, const SheetMatrix& matrix, float inertia, const Slides& slides) {
  if (matrix_.complete) {
    // When it is refused, the last factor stays in force.
    matrix_.complete =
        matrix_.factor.Continue(kernels_, matrix_.next, kFactorColumnsPerStep) == CoarseFactor::Progress::kMore;
  } else {
    AddRows(sheet, matrix, inertia, slides, kRowsPerStep);
  }
}

}  // namespace fulcrum::physics::implicit
