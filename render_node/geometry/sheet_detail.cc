#include "render_node/geometry/sheet_detail.h"

#include <algorithm>
#include <array>

namespace fulcrum::render {
namespace {

using Block = SheetDetail::Block;

constexpr float kPixels = 0.5f;
constexpr float kNormal = 0.15f;

struct Steps {
  std::uint32_t rows, cols;
};
// Finest first. Each divides the next, and the last one the block.
constexpr std::array<Steps, 4> kLevels{{{1, 1}, {2, 1}, {4, 2}, {8, 4}}};

/// Calls visit(first row, last row, first col, last col) for each quad of the division until a call returns false.
template <class Visit>
bool AllQuads(const Block& block, const Steps& steps, const Visit& visit) {
  for (std::uint32_t r = block.row; r < block.row_end; r += steps.rows) {
    for (std::uint32_t c = block.col; c < block.col_end; c += steps.cols) {
      if (!visit(r, std::min(r + steps.rows, block.row_end), c, std::min(c + steps.cols, block.col_end))) {
        return false;
      }
    }
  }
  return true;
}

bool Smooth(const MembraneMesh& membrane, std::uint32_t cols, const Block& block, const Steps& steps,
            float tolerance_m) {
  const std::span<const Vec3f> x = membrane.positions(), n = membrane.normals();
  return AllQuads(block, steps, [&](std::uint32_t r0, std::uint32_t r1, std::uint32_t c0, std::uint32_t c1) {
    const Index n00 = r0 * cols + c0, n01 = r0 * cols + c1, n10 = r1 * cols + c0, n11 = r1 * cols + c1;
    for (std::uint32_t r = r0; r <= r1; ++r) {
      const float u = static_cast<float>(r - r0) / static_cast<float>(r1 - r0);
      for (std::uint32_t c = c0; c <= c1; ++c) {
        const float v = static_cast<float>(c - c0) / static_cast<float>(c1 - c0);
        // The diagonal goes from n00 to n11, as in each cell.
        const Index corner = v >= u ? n01 : n10;
        const float w00 = 1 - std::max(u, v), w11 = std::min(u, v), w = 1 - w00 - w11;
        const Index node = r * cols + c;
        if ((w00 * x[n00] + w11 * x[n11] + w * x[corner] - x[node]).squaredNorm() > tolerance_m * tolerance_m ||
            (w00 * n[n00] + w11 * n[n11] + w * n[corner] - n[node]).squaredNorm() > kNormal * kNormal) {
          return false;
        }
      }
    }
    return true;
  });
}

std::uint32_t Snap(std::uint32_t value, std::uint32_t first, std::uint32_t end, std::uint32_t step) {
  return value == end ? value : first + (value - first) / step * step;
}

}  // namespace

SheetDetail::SheetDetail(const MembraneGrid& grid) : grid_(grid) {}

SheetDetail::Block SheetDetail::BlockAt(std::uint32_t row, std::uint32_t col) const {
  return {row * MembraneMesh::kBlockRows, std::min((row + 1) * MembraneMesh::kBlockRows, grid_.rows - 1),
          col * MembraneMesh::kBlockCols, std::min((col + 1) * MembraneMesh::kBlockCols, grid_.cols - 1)};
}

bool SheetDetail::BesideCut(const MembraneMesh& membrane, std::uint32_t row, std::uint32_t col) const {
  for (std::uint32_t r = row > 0 ? row - 1 : 0; r <= std::min(row + 1, membrane.block_rows() - 1); ++r) {
    for (std::uint32_t c = col > 0 ? col - 1 : 0; c <= std::min(col + 1, membrane.block_cols() - 1); ++c) {
      if (!membrane.block_intact(std::size_t{r} * membrane.block_cols() + c)) {
        return true;
      }
    }
  }
  return false;
}

void SheetDetail::ChooseLevels(const MembraneMesh& membrane, const Vec3f& eye_W, float pixels_per_rad) {
  levels_.assign(std::size_t{membrane.block_rows()} * membrane.block_cols(), 0);
  for (std::uint32_t row = 0; row < membrane.block_rows(); ++row) {
    for (std::uint32_t col = 0; col < membrane.block_cols(); ++col) {
      if (BesideCut(membrane, row, col)) {
        continue;
      }
      const Block block = BlockAt(row, col);
      const float distance_m = (membrane.positions()[block.row * grid_.cols + block.col] - eye_W).norm();
      const float tolerance_m = kPixels * distance_m / pixels_per_rad;
      std::size_t level = kLevels.size() - 1;
      while (level > 0 && !Smooth(membrane, grid_.cols, block, kLevels[level], tolerance_m)) {
        --level;
      }
      levels_[std::size_t{row} * membrane.block_cols() + col] = static_cast<std::uint8_t>(level);
    }
  }
}

// A node on the border of two blocks is snapped to the nearest node of the coarser block, so that there is no gap.
void SheetDetail::AppendBlock(const MembraneMesh& membrane, std::uint32_t row, std::uint32_t col,
                              std::vector<Triangle>* out) const {
  const std::size_t width = membrane.block_cols(), index = row * width + col;
  const auto coarser = [&](bool there, std::size_t other) {
    return kLevels[there ? std::max(levels_[index], levels_[other]) : levels_[index]];
  };
  const Block block = BlockAt(row, col);
  const std::uint32_t above = coarser(row > 0, index - width).cols, left = coarser(col > 0, index - 1).rows;
  const std::uint32_t below = coarser(row + 1 < membrane.block_rows(), index + width).cols;
  const std::uint32_t right = coarser(col + 1 < width, index + 1).rows;
  const auto node = [&](std::uint32_t r, std::uint32_t c) -> Index {
    const std::uint32_t snapped_c = r == block.row       ? Snap(c, block.col, block.col_end, above)
                                    : r == block.row_end ? Snap(c, block.col, block.col_end, below)
                                                         : c;
    const std::uint32_t snapped_r = c == block.col       ? Snap(r, block.row, block.row_end, left)
                                    : c == block.col_end ? Snap(r, block.row, block.row_end, right)
                                                         : r;
    return snapped_r * grid_.cols + snapped_c;
  };
  const auto append = [out](Index a, Index b, Index c) {
    if (a != b && b != c && c != a) {
      out->push_back({a, b, c});
    }
  };
  AllQuads(block, kLevels[levels_[index]], [&](std::uint32_t r0, std::uint32_t r1, std::uint32_t c0, std::uint32_t c1) {
    const Index n00 = node(r0, c0), n01 = node(r0, c1), n10 = node(r1, c0), n11 = node(r1, c1);
    append(n00, n01, n11);
    append(n00, n11, n10);
    return true;
  });
}

void SheetDetail::Choose(const MembraneMesh& membrane, const Vec3f& eye_W, float pixels_per_rad,
                         std::span<const std::uint8_t> untouched, SheetRuns* out) {
  out->triangles.clear();
  out->ends.clear();
  if (grid_.node_count() == 0) {
    return;
  }
  ChooseLevels(membrane, eye_W, pixels_per_rad);
  const std::span<const Vec3f> x = membrane.positions();
  const bool last_is_far = (x[0] - eye_W).norm() < (x[grid_.node_count() - 1] - eye_W).norm();
  const auto is_untouched = [&](std::size_t block) { return membrane.block_intact(block) && untouched[block] != 0; };
  bool now = true;  // Run 0 is of untouched blocks.
  const auto end_run = [&] {
    out->ends.push_back(out->triangles.size());
    now = !now;
  };
  for (std::uint32_t k = 0; k < membrane.block_rows(); ++k) {
    const std::uint32_t row = last_is_far ? membrane.block_rows() - 1 - k : k;
    const std::size_t first = std::size_t{row} * membrane.block_cols();
    // Within a row the present run goes on first.
    for (const bool wanted : {now, !now}) {
      for (std::uint32_t col = 0; col < membrane.block_cols(); ++col) {
        const std::size_t index = first + col;
        if (is_untouched(index) != wanted) continue;
        if (now != wanted) end_run();
        if (membrane.block_intact(index)) {
          AppendBlock(membrane, row, col, &out->triangles);
        } else {
          const auto triangles = membrane.block_triangles(index);
          out->triangles.insert(out->triangles.end(), triangles.begin(), triangles.end());
        }
      }
    }
  }
  const auto parts = membrane.triangles().subspan(membrane.whole_triangles());
  if (now && !parts.empty()) end_run();
  out->triangles.insert(out->triangles.end(), parts.begin(), parts.end());
  end_run();
}

}  // namespace fulcrum::render
