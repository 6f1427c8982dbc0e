#include "physics_node/implicit/coarse_space.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace fulcrum::physics::implicit {
namespace {

constexpr int kSheetRows = 9;
constexpr double kLattice = 0.030;  ///< [m]

/// Part of the mean diagonal that is added to it: nodes of little support must not make the matrix singular.
constexpr float kRegularisation = 1e-5f;

/// Coarse node positions 0 .. count-1 spread evenly over 0 .. fine-1.
template <class Place>
std::vector<Place> Spread(int fine, int count) {
  std::vector<Place> place;
  for (int i = 0; i < fine; ++i) {
    const double at = fine > 1 ? static_cast<double>(i) * (count - 1) / (fine - 1) : 0.0;
    const int cell = std::clamp(static_cast<int>(at), 0, std::max(count - 2, 0));
    place.push_back({cell, static_cast<float>(at - cell)});
  }
  return place;
}

/// The coarse nodes in order along the longest side of the box around them: each has neighbours only near by.
std::vector<std::uint32_t> AlongLongestSide(const std::vector<Vec3d>& place) {
  Eigen::AlignedBox3d box;
  for (const Vec3d& p : place) {
    box.extend(p);
  }
  Eigen::Index axis = 0;
  if (!place.empty()) {
    box.sizes().maxCoeff(&axis);
  }
  std::vector<std::uint32_t> order(place.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return place[a][axis] < place[b][axis]; });
  return order;
}

/// Sums of symmetric matrices xx yy zz xy xz yz, times 1, t and t^2.
struct Moments {
  std::array<std::array<float, 6>, 3> sum{};
  void Add(const std::array<float, 6>& element, float t) {
    for (std::size_t i = 0; i < 6; ++i) {
      sum[0][i] += element[i];
      sum[1][i] += t * element[i];
      sum[2][i] += t * t * element[i];
    }
  }
};

}  // namespace

CoarseSpace::CoarseSpace(const SceneView& scene, const ElasticModel& model, const ParticleStore& particles,
                         const Kernels& kernels)
    : kernels_(kernels),
      rows_(static_cast<int>(scene.membrane.rows)),
      stride_(static_cast<int>(particles.layout().stride)),
      tube_floats_(particles.tube_floats()),
      cols_(scene.membrane.cols),
      layout_(particles.layout()) {
  columns_ = std::min(kSheetColumns, static_cast<int>(cols_));
  coarse_rows_ = std::min(kSheetRows, rows_);
  row_place_ = Spread<RowPlace>(rows_, coarse_rows_);
  column_place_ = Spread<RowPlace>(static_cast<int>(cols_), columns_);
  BuildMiddle();
  nodes_ = columns_ * coarse_rows_;
  // The lattice over the organ; only nodes that carry something get a number.
  std::map<std::array<int, 3>, std::uint16_t> lattice;
  for (Index v = 0; v < scene.tube_vertex_count; ++v) {
    const Vec3d at = model.rest_position[v] / kLattice;
    Weights8 weights{};
    const Vec3d low = at.array().floor();
    for (int corner = 0; corner < 8; ++corner) {
      std::array<int, 3> key;
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const int up = (corner >> axis) & 1;
        const double fraction = at[axis] - low[axis];
        key[static_cast<std::size_t>(axis)] = static_cast<int>(low[axis]) + up;
        weight *= up ? fraction : 1 - fraction;
      }
      const auto [it, fresh] = lattice.try_emplace(key, static_cast<std::uint16_t>(nodes_));
      nodes_ += fresh ? 1 : 0;
      weights.node[static_cast<std::size_t>(corner)] = it->second;
      weights.weight[static_cast<std::size_t>(corner)] = model.fixed(v) ? 0.0f : static_cast<float>(weight);
    }
    weights.new_cell = v == 0 || weights.node != tube_weights_.back().node;
    tube_weights_.push_back(weights);
  }
  const Eigen::Index n = 3 * nodes_;
  constant_ = Eigen::MatrixXf::Zero(n, n);
  tube_mass_ = Eigen::MatrixXf::Zero(n, n);
  building_ = Eigen::MatrixXf::Zero(n, n);
  std::vector<Vec3d> place;
  for (int i = 0; i < coarse_rows_; ++i) {
    for (int j = 0; j < columns_; ++j) {
      const int row = i * (rows_ - 1) / std::max(coarse_rows_ - 1, 1),
                column = j * (static_cast<int>(cols_) - 1) / std::max(columns_ - 1, 1);
      place.push_back(
          model.rest_position[scene.membrane.first + static_cast<Index>(row) * cols_ + static_cast<Index>(column)]);
    }
  }
  place.resize(static_cast<std::size_t>(nodes_));
  for (const auto& [key, node] : lattice) {
    place[node] = kLattice * Vec3d(key[0], key[1], key[2]);
  }
  factor_ = CoarseFactor(AlongLongestSide(place));
  nodes4_ = FloatArray(4 * static_cast<std::size_t>(nodes_));
  tube_nodes4_ = FloatArray(4 * static_cast<std::size_t>(nodes_));
  AddTube(model);
  AddBindings(model, particles);
}

void CoarseSpace::BuildMiddle() {
  const int slots = static_cast<int>(layout_.slots);
  middle_slots_ = (slots + 3) / 4;
  width_ = static_cast<std::size_t>(middle_slots_) * kLanes;
  for (int row = 0; row < rows_; row += 4) {
    centre_.push_back(row);
  }
  if (rows_ > 0 && centre_.back() != rows_ - 1) {
    centre_.push_back(rows_ - 1);
  }
  middle_rows_ = static_cast<int>(centre_.size());
  for (int row = 0; row < rows_; ++row) {
    const int cell = row / 4;
    cell_.push_back(cell);
    const int span = cell + 1 < middle_rows_ ? centre_[static_cast<std::size_t>(cell) + 1] - 4 * cell : 1;
    fraction_.push_back(static_cast<float>(row - 4 * cell) / static_cast<float>(span));
  }
  own_ = FloatArray(static_cast<std::size_t>(slots) * kLanes);
  next_ = FloatArray(static_cast<std::size_t>(slots) * kLanes);
  for (int s = 0; s < slots; ++s) {
    const int group = s / 4, length = std::min(4, slots - 4 * group);
    const float on = static_cast<float>(s - 4 * group) / static_cast<float>(length);
    for (int lane = 0; lane < kLanes; ++lane) {
      // Nothing follows the last lane's last group.
      const bool last = lane + 1 == kLanes && group + 1 == middle_slots_;
      const auto at = static_cast<std::size_t>(s) * kLanes + static_cast<std::size_t>(lane);
      own_[at] = last ? 1.0f : 1.0f - on;
      next_[at] = last ? 0.0f : on;
    }
  }
  scale_ = FloatArray(static_cast<std::size_t>(middle_rows_) * width_);
  std::fill_n(scale_.data(), scale_.size(), 1.0f);
  yields_.assign(static_cast<std::size_t>(middle_rows_) * width_, 1.0f);
  for (FloatArray& block : block_) {
    block = FloatArray(static_cast<std::size_t>(middle_rows_) * width_);
  }
  residual_ = FloatArray(3 * static_cast<std::size_t>(middle_rows_) * width_);
  value_ = FloatArray(3 * static_cast<std::size_t>(middle_rows_) * width_);
  column_share_ = FloatArray(static_cast<std::size_t>(columns_) * width_);
  for (std::size_t i = 0; i < width_; ++i) {
    const auto slot = static_cast<std::uint32_t>(4 * (i / kLanes)), lane = static_cast<std::uint32_t>(i % kLanes);
    const RowPlace column = column_place_[std::min(lane * layout_.slots + slot, cols_ > 0 ? cols_ - 1 : 0)];
    const auto cell = static_cast<std::size_t>(column.cell);
    column_share_[cell * width_ + i] = 1.0f - column.fraction;
    if (column.cell + 1 < columns_) {
      column_share_[(cell + 1) * width_ + i] = column.fraction;
    }
  }
}

Middle CoarseSpace::middle() {
  return {middle_rows_,
          middle_slots_,
          centre_.data(),
          own_.data(),
          next_.data(),
          cell_.data(),
          fraction_.data(),
          scale_.data(),
          {block_[0].data(), block_[1].data(), block_[2].data(), block_[3].data(), block_[4].data(), block_[5].data()},
          value_.data()};
}

void CoarseSpace::AddTube(const ElasticModel& model) {
  for (Index v = 0; v < tube_weights_.size(); ++v) {
    const Weights8& w = tube_weights_[v];
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < 8; ++j) {
        const float m = static_cast<float>(model.mass[v]) * w.weight[i] * w.weight[j];
        for (int axis = 0; axis < 3; ++axis) {
          tube_mass_(3 * w.node[i] + axis, 3 * w.node[j] + axis) += m;
        }
      }
    }
  }
  // At rest V dP = V (mu ((1 - a) dF + dF^T) + lambda_Lame tr(dF) I), and the edges.
  const double mu = model.mu_Pa, lambda = model.lambda_Pa;
  std::vector<std::pair<int, Vec3d>> gradients;
  for (const ElasticPatch& patch : model.patches) {
    gradients.clear();
    for (Index i = patch.first_link; i < patch.first_link + patch.link_count; ++i) {
      const ElasticPatchLink& link = model.patch_links[i];
      const Weights8& w = tube_weights_[link.v];
      for (std::size_t k = 0; k < 8; ++k) {
        const auto at = std::find_if(gradients.begin(), gradients.end(),
                                     [&](const auto& entry) { return entry.first == w.node[k]; });
        if (at == gradients.end()) {
          gradients.emplace_back(w.node[k], link.gradient * static_cast<double>(w.weight[k]));
        } else {
          at->second += link.gradient * static_cast<double>(w.weight[k]);
        }
      }
    }
    for (const auto& [a, ga] : gradients) {
      for (const auto& [b, gb] : gradients) {
        const Mat3d block = patch.volume * ((1 - kPatchVariance) * mu * ga.dot(gb) * Mat3d::Identity() +
                                            mu * gb * ga.transpose() + lambda * ga * gb.transpose());
        constant_.block<3, 3>(3 * a, 3 * b) += block.cast<float>();
      }
    }
  }
  for (const ElasticShearLink& link : model.shear_links) {
    const Weights8 &wa = tube_weights_[link.a], &wb = tube_weights_[link.b];
    std::vector<std::pair<int, double>> weights;
    for (std::size_t k = 0; k < 8; ++k) {
      weights.emplace_back(wa.node[k], static_cast<double>(wa.weight[k]));
      weights.emplace_back(wb.node[k], -static_cast<double>(wb.weight[k]));
    }
    for (const auto& [a, va] : weights) {
      for (const auto& [b, vb] : weights) {
        const auto k = static_cast<float>(link.stiffness * va * vb);
        for (int axis = 0; axis < 3; ++axis) {
          constant_(3 * a + axis, 3 * b + axis) += k;
        }
      }
    }
  }
}

void CoarseSpace::AddBindings(const ElasticModel& model, const ParticleStore& particles) {
  for (const ElasticBinding& binding : model.bindings) {
    std::vector<std::pair<int, double>> weights;
    const Index node = binding.membrane - particles.tube_count();
    const RowPlace& row = row_place_[node / cols_];
    const RowPlace& column = column_place_[node % cols_];
    if (!model.fixed(binding.membrane)) {
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
          const double w =
              static_cast<double>((i ? row.fraction : 1 - row.fraction) * (j ? column.fraction : 1 - column.fraction));
          if (w != 0) {
            weights.emplace_back((row.cell + i) * columns_ + column.cell + j, w);
          }
        }
      }
    }
    Vec3d direction = model.rest_position[binding.membrane];
    for (std::size_t i = 0; i < 3; ++i) {
      direction -= binding.barycentric[i] * model.rest_position[binding.surface[i]];
      const Weights8& w = tube_weights_[binding.surface[i]];
      for (std::size_t k = 0; k < 8; ++k) {
        weights.emplace_back(w.node[k], -binding.barycentric[i] * static_cast<double>(w.weight[k]));
      }
    }
    direction.normalize();
    const Mat3d stiffness = binding.stiffness * direction * direction.transpose();
    for (const auto& [a, wa] : weights) {
      for (const auto& [b, wb] : weights) {
        constant_.block<3, 3>(3 * a, 3 * b) += (wa * wb * stiffness).cast<float>();
      }
    }
  }
}

void CoarseSpace::AddSheetRow(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int row) {
  const std::size_t stride = static_cast<std::size_t>(stride_);
  const auto value = [&](const float* plane, std::uint32_t col) {
    return plane[static_cast<std::size_t>(row) * stride + layout_.Offset(0, col)];
  };
  // An edge leads to the next row at most, and coarse rows stand on rows, so both its ends lie in one coarse cell.
  const RowPlace here = row_place_[static_cast<std::size_t>(row)];
  const float next_row = row + 1 < rows_ && coarse_rows_ > 1
                             ? here.fraction + static_cast<float>(coarse_rows_ - 1) / static_cast<float>(rows_ - 1)
                             : here.fraction;
  const float next_column = columns_ > 1 ? static_cast<float>(columns_ - 1) / static_cast<float>(cols_ - 1) : 0.0f;
  std::array<int, 4> node;
  std::array<std::array<std::array<float, 6>, 4>, 4> sum{};
  int cell = 0;
  const auto shape = [](float row_fraction, float column_fraction) {
    return std::array<float, 4>{(1 - row_fraction) * (1 - column_fraction), (1 - row_fraction) * column_fraction,
                                row_fraction * (1 - column_fraction), row_fraction * column_fraction};
  };
  // In a coarse cell the weights of a kind of edge (0..2, and 3: a node's mass) are linear along the row, so three
  // moments of their matrices are all that is needed of them.
  std::array<Moments, 4> moments{};
  const auto add_moments = [&](std::size_t kind) {
    const auto weights = [&](float t) {
      std::array<float, 4> w = shape(here.fraction, t);
      if (kind < 3) {
        const auto far = shape(kind == 0 ? here.fraction : next_row, kind == 1 ? t : t + next_column);
        for (std::size_t i = 0; i < 4; ++i) {
          w[i] -= far[i];
        }
      }
      return w;
    };
    const std::array<float, 4> constant = weights(0), at_end = weights(1);
    for (std::size_t a = 0; a < 4; ++a) {
      const float slope_a = at_end[a] - constant[a];
      for (std::size_t b = a; b < 4; ++b) {
        const float slope_b = at_end[b] - constant[b];
        for (std::size_t i = 0; i < 6; ++i) {
          sum[a][b][i] += constant[a] * constant[b] * moments[kind].sum[0][i] +
                          (constant[a] * slope_b + slope_a * constant[b]) * moments[kind].sum[1][i] +
                          slope_a * slope_b * moments[kind].sum[2][i];
        }
      }
    }
  };
  const auto flush = [&] {
    for (std::size_t kind = 0; kind < 4; ++kind) {
      add_moments(kind);
    }
    moments = {};
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        const std::array<float, 6>& k = a <= b ? sum[a][b] : sum[b][a];
        Eigen::Matrix3f block;
        block << k[0], k[3], k[4], k[3], k[1], k[5], k[4], k[5], k[2];
        if (node[a] < 0 || node[b] < 0) {
          continue;
        }
        building_.block<3, 3>(3 * node[a], 3 * node[b]) += block;
      }
    }
    sum = {};
  };
  const auto enter = [&](int new_cell) {
    cell = new_cell;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const int i = corner < 2 ? 0 : 1, j = static_cast<int>(corner % 2);
      const bool exists = here.cell + i < coarse_rows_ && cell + j < columns_;
      node[corner] = exists ? (here.cell + i) * columns_ + cell + j : -1;
    }
  };
  const auto add = [&](const std::array<float, 4>& w, const std::array<float, 6>& element) {
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = a; b < 4; ++b) {
        for (std::size_t i = 0; i < 6; ++i) {
          sum[a][b][i] += w[a] * w[b] * element[i];
        }
      }
    }
  };
  enter(0);
  for (std::uint32_t col = 0; col < cols_; ++col) {
    const RowPlace at = column_place_[col];
    if (at.cell != cell) {
      flush();
      enter(at.cell);
    }
    const bool moves = value(sheet.w, col) > 0.0f;
    if (moves) {
      const float mass = value(sheet.mass, col) * inertia;
      moments[3].Add({mass, mass, mass, 0, 0, 0}, at.fraction);
    }
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t down = d != 0 ? stride : 0;
      const std::uint32_t to = d != 1 ? col + 1 : col;
      if (to >= cols_ || (down && row + 1 >= rows_) || !(value(sheet.axial[d], col) > 0.0f)) {
        continue;
      }
      float e[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float* x = matrix.place[axis] + static_cast<std::size_t>(row) * stride;
        e[axis] = x[down + layout_.Offset(0, to)] - x[layout_.Offset(0, col)];
      }
      const float k = value(matrix.kt[d], col), along = value(matrix.along[d], col);
      const std::array<float, 6> element{k + along * e[0] * e[0], k + along * e[1] * e[1], k + along * e[2] * e[2],
                                         along * e[0] * e[1],     along * e[0] * e[2],     along * e[1] * e[2]};
      const bool far_moves = sheet.w[static_cast<std::size_t>(row) * stride + down + layout_.Offset(0, to)] > 0.0f;
      if (moves && far_moves) {
        moments[d].Add(element, at.fraction);
      } else if (moves) {
        add(shape(here.fraction, at.fraction), element);
      } else if (far_moves) {
        add(shape(down ? next_row : here.fraction, at.fraction + (d != 1 ? next_column : 0.0f)), element);
      }
    }
  }
  flush();
}

void CoarseSpace::AddRows(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int rows) {
  if (next_row_ == 0) {
    building_ = constant_ + inertia * tube_mass_;
  }
  for (const int end = std::min(next_row_ + rows, rows_); next_row_ < end; ++next_row_) {
    AddSheetRow(sheet, matrix, inertia, next_row_);
  }
  complete_ = next_row_ == rows_;
  if (complete_) {
    next_row_ = 0;
    building_.diagonal().array() += kRegularisation * building_.diagonal().mean();
  }
}

void CoarseSpace::Renew(const Sheet& sheet, const SheetMatrix& matrix, float inertia) {
  next_row_ = 0;
  AddRows(sheet, matrix, inertia, rows_);
  (void)factor_.Take(kernels_, building_);
  complete_ = false;
}

void CoarseSpace::Refresh(const Sheet& sheet, const SheetMatrix& matrix, float inertia) {
  if (complete_) {
    // If it is refused, the last one serves on.
    complete_ = factor_.Continue(kernels_, building_, kRefreshColumns) == CoarseFactor::Progress::kMore;
  } else {
    AddRows(sheet, matrix, inertia, kRefreshRows);
  }
}

std::pair<int, int> CoarseSpace::MiddleRows(int first, int end) const {
  const auto before = [&](int row) {
    return static_cast<int>(std::lower_bound(centre_.begin(), centre_.end(), row) - centre_.begin());
  };
  return {before(first), before(end)};
}

}  // namespace fulcrum::physics::implicit
