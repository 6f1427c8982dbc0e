#include "physics_node/implicit/coarse_space.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"

namespace fulcrum::physics::implicit {
namespace {

/// Coarse nodes over the membrane. With those of the lattice they are some 250 in built-in, so the factor has some 750
/// rows. Assumed.
constexpr int kCoarseRows = 9, kCoarseColumns = 4;
/// Distance of the nodes of the lattice over a single organ [m]: the outer radius of built-in. With 30 mm the organ's
/// ovalling, which is soft, converges slowly (deploy/docs/measurements/physics, Lattice over the organ).
constexpr double kLattice_m = 0.018;
/// Memory is reserved for so many contacts with tools, all that two tools can have, and for so many hats
/// around the edits of a step, eight an edit; with more the lists grow.
constexpr std::size_t kReservedStiffContacts = 2048, kReservedEdits = 8192;

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

/// The part of a coarse cell between two neighbours, and the fine place of each coarse node.
float StepOf(int fine, int count) {
  return count > 1 ? static_cast<float>(count - 1) / static_cast<float>(fine - 1) : 0.0f;
}
std::vector<int> NodesAt(int first, int fine, int count) {
  std::vector<int> at;
  at.reserve(static_cast<std::size_t>(std::max(count, 0)));
  for (int i = 0; i < count; ++i) at.push_back(first + i * (fine - 1) / std::max(count - 1, 1));
  return at;
}

/// Continues places linearly up to `count` of them.
template <class Place>
void Continue(std::size_t count, float step, std::vector<Place>* place) {
  while (place->size() < count) {
    Place next = place->back();
    next.fraction += step;
    place->push_back(next);
  }
}

/// So many of `most` coarse nodes that there are not more than hats `spacing` apart, and two at least.
int CoarseCount(int fine, int most, int spacing) {
  return std::min({most, std::max((fine - 1) / spacing + 1, 2), fine});
}

/// The coarse nodes by groups, each along the longest side of the box around it: neighbours are close in it, so the
/// factor is a band.
std::vector<std::vector<std::uint32_t>> Order(const std::vector<Vec3d>& place, const std::vector<std::size_t>& group,
                                              std::size_t groups) {
  std::vector<std::vector<std::uint32_t>> order(groups);
  std::vector<Eigen::AlignedBox3d> box(groups);
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    order[group[i]].push_back(i);
    box[group[i]].extend(place[i]);
  }
  for (std::size_t g = 0; g < groups; ++g) {
    Eigen::Index axis = 0;
    if (!order[g].empty()) box[g].sizes().maxCoeff(&axis);
    std::stable_sort(order[g].begin(), order[g].end(),
                     [&](std::uint32_t a, std::uint32_t b) { return place[a][axis] < place[b][axis]; });
  }
  return order;
}

}  // namespace

CoarseSpace::CoarseSpace(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles,
                         const Kernels& kernels)
    : kernels_(kernels),
      layout_(particles.layout()),
      tube_floats_(particles.tube_floats()),
      sheet_rows_(static_cast<int>(scene.membrane.rows)) {
  PlaceCoarseNodes(scene);
  BuildHats();
  // The blocks of hats at the rim of a sheet hold what edges there are.
  for (Index edge = 0; !scene.sheets.empty() && edge < scene.membrane_rest_length.size(); ++edge) {
    const Index row = edge / 3 / layout_.cols, col = edge / 3 % layout_.cols;
    if (!(scene.membrane_rest_length[edge] > 0.0f)) MarkEdit(row, col, edge % 3);
  }
  BuildLattice(scene, model);
  const Eigen::Index n = 3 * grid_.nodes;
  matrix_.constant = Eigen::MatrixXf::Zero(n, n);
  matrix_.tube_mass = Eigen::MatrixXf::Zero(n, n);
  matrix_.next = Eigen::MatrixXf::Zero(n, n);
  AddTubeMass(model);
  AddTube(model);
  AddBindings(model, particles);
}

/// Each sheet has coarse nodes of its own, so that a correction of one does not move another: of the longest
/// kCoarseRows rows, of the others fewer in proportion, and not more than hats: what coarse nodes between two hats add
/// would not be in the coarse matrix. Beyond a sheet they are continued linearly: so are hats, whose centres need not
/// lie on it.
void CoarseSpace::PlaceCoarseNodes(const TissueScene& scene) {
  const std::vector<SheetPart> sheets = SheetsOf(scene);
  const int hat_columns = std::max(std::min(kHatSpacing, static_cast<int>(layout_.slots)), 1);
  std::uint32_t longest = 0;
  for (const SheetPart& sheet : sheets) longest = std::max(longest, sheet.rows);
  for (const SheetPart& sheet : sheets) {
    const int rows = static_cast<int>(sheet.rows), cols = static_cast<int>(sheet.cols);
    const auto share = static_cast<int>(std::lround(1.0 * kCoarseRows * sheet.rows / longest));
    const int count = CoarseCount(rows, std::max(share, 2), kHatSpacing);
    if (!grid_.row_place.empty()) {
      const float step = grid_.row_step.back();
      Continue(sheet.first_row, step, &grid_.row_place);
      grid_.row_step.resize(sheet.first_row, step);
    }
    for (CellPlace place : Spread<CellPlace>(rows, count)) {
      place.cell += grid_.rows;
      grid_.row_place.push_back(place);
    }
    grid_.row_step.resize(grid_.row_place.size(), StepOf(rows, count));
    const std::vector<int> at = NodesAt(static_cast<int>(sheet.first_row), rows, count);
    grid_.row_at.insert(grid_.row_at.end(), at.begin(), at.end());
    grid_.rows += count;
    const int columns = CoarseCount(cols, kCoarseColumns, hat_columns);
    CoarseGrid::Columns of{Spread<CellPlace>(cols, columns), StepOf(cols, columns), NodesAt(0, cols, columns),
                           FloatArray()};
    Continue(layout_.cols, of.step, &of.place);
    of.at.resize(kCoarseColumns, cols - 1);
    grid_.sheets.push_back(std::move(of));
    grid_.columns = std::max(grid_.columns, columns);
  }
  grid_.sheet_of = SheetOfRows(scene);
}

void CoarseSpace::BuildHats() {
  const int slots = static_cast<int>(layout_.slots);
  hats_.slots = (slots + kHatSpacing - 1) / kHatSpacing;
  hats_.width = static_cast<std::size_t>(hats_.slots) * kLanes;
  for (int row = 0; row < sheet_rows_; row += kHatSpacing) {
    hats_.centre.push_back(row);
  }
  if (sheet_rows_ > 0 && hats_.centre.back() != sheet_rows_ - 1) {
    hats_.centre.push_back(sheet_rows_ - 1);
  }
  hats_.rows = static_cast<int>(hats_.centre.size());
  for (int row = 0; row < sheet_rows_; ++row) {
    const int cell = row / kHatSpacing, first = kHatSpacing * cell;
    hats_.cell.push_back(cell);
    const int span = cell + 1 < hats_.rows ? hats_.centre[static_cast<std::size_t>(cell) + 1] - first : 1;
    hats_.fraction.push_back(static_cast<float>(row - first) / static_cast<float>(span));
  }
  hats_.own = FloatArray(static_cast<std::size_t>(slots) * kLanes);
  hats_.next = FloatArray(static_cast<std::size_t>(slots) * kLanes);
  for (int s = 0; s < slots; ++s) {
    const int group = s / kHatSpacing, first = kHatSpacing * group, length = std::min(kHatSpacing, slots - first);
    const float on = static_cast<float>(s - first) / static_cast<float>(length);
    for (int lane = 0; lane < kLanes; ++lane) {
      // Nothing follows the last lane's last group.
      const bool last = lane + 1 == kLanes && group + 1 == hats_.slots;
      const auto at = static_cast<std::size_t>(s) * kLanes + static_cast<std::size_t>(lane);
      hats_.own[at] = last ? 1.0f : 1.0f - on;
      hats_.next[at] = last ? 0.0f : on;
    }
  }
  const std::size_t count = static_cast<std::size_t>(hats_.rows) * hats_.width;
  blocks_.scale = FloatArray(count);
  std::fill_n(blocks_.scale.data(), count, 1.0f);
  for (FloatArray& block : blocks_.inverse) {
    block = FloatArray(count);
  }
  contacts_.coarse_weight.assign(count, 1.0f);
  contacts_.stiff.reserve(kHatsPerContact * kReservedStiffContacts);
  blocks_.edited.reserve(kReservedEdits);
  blocks_.off.reserve(static_cast<std::size_t>(hats_.rows));
  MarkSteepHats();
  scratch_.residual = FloatArray(3 * count);
  scratch_.value = FloatArray(3 * count);
  ShareColumns();
}

void CoarseSpace::ShareColumns() {
  const std::uint32_t last = layout_.cols > 0 ? layout_.cols - 1 : 0;
  for (CoarseGrid::Columns& columns : grid_.sheets) {
    columns.share = FloatArray(static_cast<std::size_t>(grid_.columns) * hats_.width);
    for (std::size_t i = 0; i < hats_.width; ++i) {
      const auto slot = static_cast<std::uint32_t>(kHatSpacing * (i / kLanes)),
                 lane = static_cast<std::uint32_t>(i % kLanes);
      const CellPlace column = columns.place[std::min(lane * layout_.slots + slot, last)];
      const auto cell = static_cast<std::size_t>(column.cell);
      columns.share[cell * hats_.width + i] = 1.0f - column.fraction;
      if (column.cell + 1 < grid_.columns) {
        columns.share[(cell + 1) * hats_.width + i] = column.fraction;
      }
    }
  }
}

HatLevel CoarseSpace::hats() {
  return {hats_.rows,
          hats_.slots,
          hats_.centre.data(),
          hats_.own.data(),
          hats_.next.data(),
          hats_.cell.data(),
          hats_.fraction.data(),
          blocks_.scale.data(),
          {blocks_.inverse[0].data(), blocks_.inverse[1].data(), blocks_.inverse[2].data(), blocks_.inverse[3].data(),
           blocks_.inverse[4].data(), blocks_.inverse[5].data()},
          scratch_.value.data()};
}

std::array<int, 4> CoarseSpace::CoarseGrid::NodesOf(int row_cell, int column_cell) const {
  std::array<int, 4> around{};
  for (int corner = 0; corner < 4; ++corner) {
    const int row = row_cell + corner / 2, column = column_cell + corner % 2;
    around[static_cast<std::size_t>(corner)] = row < rows && column < columns ? row * columns + column : -1;
  }
  return around;
}

/// Origin and distance of a solid's nodes.
struct CoarseSpace::Lattice {
  Vec3d origin = Vec3d::Zero();
  double spacing = kLattice_m;

  [[nodiscard]] std::array<int, 3> CellOf(const Vec3d& p, Vec3d* fraction) const {
    const Vec3d at = (p - origin) / spacing, low = at.array().floor();
    *fraction = at - low;
    return {static_cast<int>(low[0]), static_cast<int>(low[1]), static_cast<int>(low[2])};
  }
};

/// Small solids get a lattice as fine as their number of vertices permits: bending of something thin is not in the span
/// of a coarse one, and converges over seconds. Large ones get a coarser one: the factor's cost grows faster than
/// theirs. A single one begins with kLattice_m, and its lattice becomes coarser only.
CoarseSpace::Lattice CoarseSpace::LatticeOf(const Solid& solid, std::size_t solids, const ElasticModel& model) {
  constexpr double kFiner = 0.75, kFinest_m = 0.002;
  // A lattice has at least the nodes of one cell.
  constexpr std::size_t kMostNodes = 96, kVerticesPerNode = 8, kLeastNodes = 8;
  // Of all solids but the organ, and of a single one: matrix and factor grow with the square of the number.
  constexpr std::size_t kNodesOfAll = 480;
  const std::span<const Vec3d> points = std::span(model.rest_position).subspan(solid.first_vertex, solid.vertex_count);
  Lattice lattice;
  if (points.empty()) return lattice;
  const auto nodes = [&](const Lattice& of) {
    std::set<std::array<int, 3>> keys;
    for (const Vec3d& p : points) {
      Vec3d fraction;
      const std::array<int, 3> cell = of.CellOf(p, &fraction);
      for (int corner = 0; corner < 8; ++corner) {
        keys.insert({cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)});
      }
    }
    return keys.size();
  };
  if (solids < 2) {
    while (nodes(lattice) > kNodesOfAll) lattice.spacing /= kFiner;
    return lattice;
  }
  lattice.origin = points[0];
  for (const Vec3d& p : points) lattice.origin = lattice.origin.cwiseMin(p);
  lattice.origin.array() -= 1e-6;
  const std::size_t share = solid.first_vertex == 0 ? points.size() : kNodesOfAll / (solids - 1);
  const std::size_t most =
      std::max(kLeastNodes, std::min(std::max(kMostNodes, points.size() / kVerticesPerNode), share));
  while (nodes(lattice) > most) lattice.spacing /= kFiner;
  for (Lattice finer = lattice; finer.spacing > kFinest_m; lattice = finer) {
    finer.spacing *= kFiner;
    if (nodes(finer) > std::min({kMostNodes, points.size(), most})) break;
  }
  return lattice;
}

/// The lattices over the solids; only nodes that carry something get a number.
void CoarseSpace::BuildLattice(const TissueScene& scene, const ElasticModel& model) {
  grid_.nodes = grid_.columns * grid_.rows;
  const std::vector<Index> solid = SolidOfVertices(scene);
  std::vector<Lattice> lattices;
  std::vector<Solid> solids(scene.solids.begin(), scene.solids.end());
  if (solids.empty()) {  // A scene of one organ, or of none.
    solids.emplace_back();
    solids.front().vertex_count = scene.tube_vertex_count;
  }
  for (const Solid& s : solids) lattices.push_back(LatticeOf(s, solids.size(), model));
  std::map<std::pair<Index, std::array<int, 3>>, std::uint16_t> numbers;
  for (Index v = 0; v < scene.tube_vertex_count; ++v) {
    LatticePlace weights{};
    Vec3d fraction;
    const std::array<int, 3> cell = lattices[solid[v]].CellOf(model.rest_position[v], &fraction);
    for (std::size_t corner = 0; corner < kCellCorners; ++corner) {
      std::array<int, 3> key = cell;
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const int up = static_cast<int>(corner >> axis) & 1;
        key[static_cast<std::size_t>(axis)] += up;
        weight *= up ? fraction[axis] : 1 - fraction[axis];
      }
      const auto [it, fresh] = numbers.try_emplace({solid[v], key}, static_cast<std::uint16_t>(grid_.nodes));
      grid_.nodes += fresh ? 1 : 0;
      weights.node[corner] = it->second;
      weights.weight[corner] = model.fixed(v) ? 0.0f : static_cast<float>(weight);
    }
    weights.new_cell = v == 0 || weights.node != grid_.tube_weights.back().node;
    grid_.tube_weights.push_back(weights);
  }
  const std::vector<Index> body_of_sheet = BodyOfSheets(scene);
  std::size_t bodies = lattices.size();
  for (const Index body : body_of_sheet) bodies = std::max(bodies, body + std::size_t{1});
  grid_.body.assign(static_cast<std::size_t>(grid_.nodes), 0);
  for (int node = 0; node < grid_.rows * grid_.columns; ++node) {
    const auto row = static_cast<std::size_t>(grid_.row_at[static_cast<std::size_t>(node / grid_.columns)]);
    const Index body = body_of_sheet[grid_.sheet_of[row]];
    grid_.body[static_cast<std::size_t>(node)] = static_cast<int>(body);
  }
  grid_.lattice.resize(lattices.size());
  for (const auto& [key, node] : numbers) {
    grid_.body[node] = static_cast<int>(key.first);
    grid_.lattice[key.first].push_back(node);
  }
  grid_.folded.reserve(numbers.size());
  grid_.off.reserve(grid_.body.size());
  std::vector<Vec3d> place;
  for (int i = 0; i < grid_.rows; ++i) {
    for (int j = 0; j < grid_.columns; ++j) {
      const int row = grid_.row_at[static_cast<std::size_t>(i)],
                column = grid_.sheets[grid_.sheet_of[static_cast<std::size_t>(row)]].at[static_cast<std::size_t>(j)];
      place.push_back(model.rest_position[scene.membrane.first + static_cast<Index>(row) * layout_.cols +
                                          static_cast<Index>(column)]);
    }
  }
  place.resize(static_cast<std::size_t>(grid_.nodes));
  std::vector<std::size_t> group;
  for (const int body : grid_.body) group.push_back(GroupOf(body, bodies));
  for (const auto& [key, node] : numbers) {
    const Lattice& lattice = lattices[key.first];
    place[node] = lattice.origin + lattice.spacing * Vec3d(key.second[0], key.second[1], key.second[2]);
  }
  matrix_.factor = CoarseFactor(Order(place, group, bodies));
  matrix_.left_out.assign(bodies, 0);
  scratch_.nodes4 = FloatArray(kVertexFloats * static_cast<std::size_t>(grid_.nodes));
  scratch_.tube_nodes4 = FloatArray(kVertexFloats * static_cast<std::size_t>(grid_.nodes));
}

void CoarseSpace::AddTubeMass(const ElasticModel& model) {
  for (Index v = 0; v < grid_.tube_weights.size(); ++v) {
    const LatticePlace& w = grid_.tube_weights[v];
    for (std::size_t i = 0; i < kCellCorners; ++i) {
      for (std::size_t j = 0; j < kCellCorners; ++j) {
        const float m = static_cast<float>(model.mass[v]) * w.weight[i] * w.weight[j];
        for (int axis = 0; axis < 3; ++axis) {
          matrix_.tube_mass(3 * w.node[i] + axis, 3 * w.node[j] + axis) += m;
        }
      }
    }
  }
}

/// The organ's matrix at rest: V dP = V (mu ((1 - a_n) dF + dF^T) + lambda_Lame tr(dF) I) at patches, and the edges.
void CoarseSpace::AddTube(const ElasticModel& model) {
  const double mu = model.mu_Pa, lambda = model.lambda_Pa;
  std::vector<std::pair<int, Vec3d>> gradients;
  for (const ElasticPatch& patch : model.patches) {
    gradients.clear();
    for (Index i = patch.first_link; i < patch.first_link + patch.link_count; ++i) {
      const ElasticPatchLink& link = model.patch_links[i];
      const LatticePlace& w = grid_.tube_weights[link.v];
      for (std::size_t k = 0; k < kCellCorners; ++k) {
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
        const Mat3d block = patch.volume * ((1 - patch.variance) * mu * ga.dot(gb) * Mat3d::Identity() +
                                            mu * gb * ga.transpose() + lambda * ga * gb.transpose());
        matrix_.constant.block<3, 3>(3 * a, 3 * b) += block.cast<float>();
      }
    }
  }
  for (const ElasticShearLink& link : model.shear_links) {
    const LatticePlace &wa = grid_.tube_weights[link.a], &wb = grid_.tube_weights[link.b];
    std::vector<std::pair<int, double>> weights;
    for (std::size_t k = 0; k < kCellCorners; ++k) {
      weights.emplace_back(wa.node[k], static_cast<double>(wa.weight[k]));
      weights.emplace_back(wb.node[k], -static_cast<double>(wb.weight[k]));
    }
    for (const auto& [a, va] : weights) {
      for (const auto& [b, vb] : weights) {
        const auto k = static_cast<float>(link.stiffness * va * vb);
        for (int axis = 0; axis < 3; ++axis) {
          matrix_.constant(3 * a + axis, 3 * b + axis) += k;
        }
      }
    }
  }
}

/// Adds share times the coarse nodes' weights at a particle.
void CoarseSpace::AddWeights(const ElasticModel& model, const ParticleStore& particles, Index particle, double share,
                             std::vector<std::pair<int, double>>* weights) const {
  if (particle < particles.tube_count()) {
    const LatticePlace& w = grid_.tube_weights[particle];
    for (std::size_t k = 0; k < kCellCorners; ++k) {
      weights->emplace_back(w.node[k], share * static_cast<double>(w.weight[k]));
    }
    return;
  }
  if (model.fixed(particle)) return;
  const Index node = particle - particles.tube_count();
  const CellPlace& row = grid_.row_place[node / layout_.cols];
  const CellPlace& column = grid_.sheets[grid_.sheet_of[node / layout_.cols]].place[node % layout_.cols];
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      const double w =
          static_cast<double>((i ? row.fraction : 1 - row.fraction) * (j ? column.fraction : 1 - column.fraction));
      if (w != 0) {
        weights->emplace_back((row.cell + i) * grid_.columns + column.cell + j, share * w);
      }
    }
  }
}

void CoarseSpace::AddBindings(const ElasticModel& model, const ParticleStore& particles) {
  std::vector<std::pair<int, double>> weights;
  const auto add = [&](const Mat3d& stiffness) {
    for (const auto& [a, wa] : weights) {
      for (const auto& [b, wb] : weights) {
        matrix_.constant.block<3, 3>(3 * a, 3 * b) += (wa * wb * stiffness).cast<float>();
      }
    }
    weights.clear();
  };
  for (const ElasticBinding& binding : model.bindings) {
    AddWeights(model, particles, binding.membrane, 1, &weights);
    Vec3d direction = model.rest_position[binding.membrane];
    for (std::size_t i = 0; i < 3; ++i) {
      direction -= binding.barycentric[i] * model.rest_position[binding.surface[i]];
      AddWeights(model, particles, binding.surface[i], -binding.barycentric[i], &weights);
    }
    direction.normalize();
    add(binding.stiffness * direction * direction.transpose());
  }
  for (const ElasticHinge& attachment : model.attachments) {
    for (std::size_t i = 0; i < attachment.v.size(); ++i) {
      AddWeights(model, particles, attachment.v[i], attachment.c[i], &weights);
    }
    add(attachment.stiffness * Mat3d::Identity());
  }
}

std::pair<int, int> CoarseSpace::HatRows(int first, int end) const {
  const auto before = [&](int row) {
    return static_cast<int>(std::lower_bound(hats_.centre.begin(), hats_.centre.end(), row) - hats_.centre.begin());
  };
  return {before(first), before(end)};
}

}  // namespace fulcrum::physics::implicit
