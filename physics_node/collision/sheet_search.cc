// Search for pairs of nodes and triangles between patches that may touch.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "physics_node/collision/sheet_collision.h"

namespace fulcrum::physics {
namespace {

/// Pairs of patches that are searched in a step, at most: more are due where tissue is scrambled or crumpled, and wait.
constexpr int kMostSearches = 64;
/// Most pairs. Assumed.
constexpr std::size_t kMostWatches = 8192;
/// Nearer than this share of the contact distance the side of a node is not certain.
constexpr float kLeastSideShare = 0.2f;
/// Cells within which two triangles are of the same layer: a node has one pair with each layer.
constexpr std::uint32_t kLayerCells = 4;
/// A node and a triangle of one sheet are at rest farther apart than this many contact distances.
constexpr float kRestDistances = 2.0f;

}  // namespace

/// Nearest triangle of `cells` to each node of `nodes`, if it is near enough and no neighbour.
void SheetCollision::SearchTile(const SheetPatches::Tile& nodes, const SheetPatches::Tile& cells, bool cut,
                                float reach) {
  struct Cell {
    std::uint32_t row, col;
    Vec3f centre;
    float radius;
  };
  std::array<Cell, std::size_t{SheetPatches::kTileCells} * SheetPatches::kTileCells> all;
  std::size_t count = 0;
  for (std::uint32_t r = cells.area.row0; r < cells.area.row1; ++r) {
    for (std::uint32_t c = cells.area.col0; c < cells.area.col1; ++c) {
      const Index first = 2 * (r * (cols_ - 1) + c);
      if (!Exists(first) && !Exists(first + 1)) continue;
      const std::array<Vec3f, 4> x{patches_.At(r, c), patches_.At(r, c + 1), patches_.At(r + 1, c),
                                   patches_.At(r + 1, c + 1)};
      Cell& cell = all[count++];
      cell = {r, c, 0.25f * (x[0] + x[1] + x[2] + x[3]), 0.0f};
      for (const Vec3f& corner : x) cell.radius = std::max(cell.radius, (corner - cell.centre).norm());
    }
  }
  for (std::uint32_t row = nodes.area.row0; row < nodes.row_end; ++row) {
    for (std::uint32_t col = nodes.area.col0; col < nodes.col_end; ++col) {
      const Vec3f p = patches_.At(row, col);
      if (cells.box.DistanceSq(p) > reach * reach || !patches_.Alive(row, col)) continue;
      const Index node = row * cols_ + col;
      Foot best;
      best.distance_sq = reach * reach;
      Index triangle = kNoIndex;
      for (std::size_t i = 0; i < count; ++i) {
        const float most = reach + all[i].radius;
        if ((p - all[i].centre).squaredNorm() > most * most) continue;
        const std::uint32_t apart = CellsBetween(node, all[i].row, all[i].col);
        if (apart == 0 || (apart < kNeighbourCells && !cut)) continue;
        for (const Index half : {0u, 1u}) {
          const Index t = 2 * (all[i].row * (cols_ - 1) + all[i].col) + half;
          if (!Exists(t)) continue;
          const Foot foot = FootOf(p, t);
          if (foot.distance_sq < best.distance_sq && !PastRim(foot) && !(apart < kNeighbourCells && Joined(node, t))) {
            best = foot;
            triangle = t;
          }
        }
      }
      if (triangle != kNoIndex) TryWatch(node, triangle, best);
    }
  }
}

/// Most of the nodes next to this one are deep on the other side of the triangle's plane: two sheets cross here.
bool SheetCollision::Crosses(Index node, const Foot& foot, float side, float distance) const {
  const std::uint32_t row = node / cols_, col = node % cols_;
  const Vec3f on_triangle = Node(node) - foot.offset;
  int behind = 0, known = 0;
  const auto look = [&](bool inside, Index edge_from, int direction, Index other) {
    if (!inside || !model_->EdgeAlive(edge_from, direction)) return;
    ++known;
    behind += side * foot.normal.dot(Node(other) - on_triangle) < -distance ? 1 : 0;
  };
  look(col + 1 < cols_, node, 0, node + 1);
  look(row + 1 < model_->rows(), node, 1, node + cols_);
  look(col > 0, node - 1, 0, node - 1);
  look(row > 0, node - cols_, 1, node - cols_);
  return 2 * behind > known;
}

void SheetCollision::TryWatch(Index node, Index triangle, const Foot& foot) {
  const std::uint32_t row = node / cols_;
  const std::size_t sheet = patches_.SheetOf(row), other = patches_.SheetOf(RowOf(triangle));
  Watch watch;
  watch.node = node;
  watch.distance = half_thickness_[sheet] + half_thickness_[other];
  const float height = foot.normal.dot(foot.offset), distance = std::sqrt(foot.distance_sq);
  watch.side = height > 0.0f ? 1.0f : -1.0f;
  if (!(std::abs(height) > kLeastSideShare * watch.distance) || watches_.size() + found_.size() >= kMostWatches ||
      IsWatched(watches_, node, triangle) || TurnedOver(foot, triangle) ||
      Crosses(node, foot, watch.side, watch.distance)) {
    return;
  }
  if (sheet == other) {
    const auto rest = [this](Index n) { return scene_.rest_position[scene_.membrane.first + n]; };
    const float least = kRestDistances * watch.distance;
    if ((rest(node) - rest(model_->TriangleNodes(triangle)[0])).squaredNorm() < least * least) return;
  }
  watch.patch = patches_.Of(row, node % cols_);
  watch.clearance = std::min(watch.distance, distance);
  SetTriangle(&watch, triangle);
  const auto fixed = [this](ParticleRef at) { return !(particles_->InverseMass(at) > 0.0f); };
  if (std::all_of(watch.at.begin(), watch.at.end(), fixed)) return;
  Refresh(foot, &watch);
  found_.push_back(watch);
}

/// A pair of the node with the layer of the triangle is in `watches`, which are ordered by node.
bool SheetCollision::IsWatched(std::span<const Watch> watches, Index node, Index triangle) const {
  const auto same_layer = [&](const Watch& watch) {
    const std::uint32_t row = RowOf(triangle), col = ColOf(triangle);
    const std::uint32_t r = RowOf(watch.triangle), c = ColOf(watch.triangle);
    const auto apart = [](std::uint32_t i, std::uint32_t j) { return i > j ? i - j : j - i; };
    return patches_.SheetOf(row) == patches_.SheetOf(r) && std::max(apart(row, r), apart(col, c)) <= kLayerCells;
  };
  auto at = std::lower_bound(watches.begin(), watches.end(), node,
                             [](const Watch& watch, Index value) { return watch.node < value; });
  for (; at != watches.end() && at->node == node; ++at) {
    if (same_layer(*at)) return true;
  }
  return false;
}

/// Of a node's pairs with one layer the first stays.
void SheetCollision::DropRepeated(std::vector<Watch>* watches) const {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < watches->size(); ++i) {
    const Watch watch = (*watches)[i];
    if (!IsWatched({watches->data(), kept}, watch.node, watch.triangle)) (*watches)[kept++] = watch;
  }
  watches->resize(kept);
}

void SheetCollision::MergeFound() {
  if (found_.empty()) return;
  // The nearest triangle of a layer first.
  std::sort(found_.begin(), found_.end(), [](const Watch& a, const Watch& b) {
    return std::tie(a.node, a.clearance, a.triangle) < std::tie(b.node, b.clearance, b.triangle);
  });
  DropRepeated(&found_);
  watches_.insert(watches_.end(), found_.begin(), found_.end());
  std::stable_sort(watches_.begin(), watches_.end(), [](const Watch& a, const Watch& b) { return a.node < b.node; });
}

bool SheetCollision::SearchPairs() {
  int searches = 0;
  const Index n = patches_.count();
  for (Index k = 0; k < n; ++k) {
    const Index a = (cursor_ + k) % n;
    std::vector<SheetPatches::Pair>& pairs = patches_.pairs(a);
    for (std::size_t i = 0; i < pairs.size();) {
      const float step = patches_.step(a) + patches_.step(pairs[i].other);
      const bool moves = step > 0.0f && pairs[i].moved + SheetPatches::kFaster * step >= SheetPatches::kSearchTravel;
      if (!moves && !pairs[i].fresh) {
        ++i;
      } else if (searches == kMostSearches) {
        cursor_ = a;
        return false;
      } else if (!patches_.StaysClose(a, pairs[i])) {
        patches_.RemovePair(a, i);
      } else {
        pairs[i].moved = 0.0f;
        pairs[i].fresh = false;
        Search(a, pairs[i].other);
        ++searches;
        ++i;
      }
    }
  }
  return true;
}

void SheetCollision::Search(Index a, Index b) {
  const std::span<const SheetPatches::Tile> of_a = patches_.Tiles(a), of_b = patches_.Tiles(b);
  const float reach = patches_.reach() + SheetPatches::kFaster * (patches_.step(a) + patches_.step(b));
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    for (std::size_t j = a == b ? i : 0; j < of_b.size(); ++j) {
      const SheetPatches::Tile &first = of_a[i], &second = of_b[j];
      const bool cut = first.cut || second.cut;
      if (SheetPatches::Adjoin(first, second)) {
        if (!cut && !first.cone.Faces(second.cone)) continue;
      } else if (first.box.DistanceSq(second.box) > reach * reach) {
        continue;
      }
      SearchTile(first, second, cut, reach);
      if (a != b || i != j) SearchTile(second, first, cut, reach);
    }
  }
}

}  // namespace fulcrum::physics
