#include "thermal_node/topology/mesh_topology.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fulcrum::thermal {
namespace {

struct Box {
  int x0, y0, x1, y1;  ///< Inclusive.
  [[nodiscard]] bool Overlaps(const Box& o) const { return x0 <= o.x1 && o.x0 <= x1 && y0 <= o.y1 && o.y0 <= y1; }
};

Box BoxOf(const Vec2f& a, const Vec2f& b) {
  const float band = BandOf(a, b);
  const Vec2f low = a.cwiseMin(b), high = a.cwiseMax(b);
  return {static_cast<int>(std::floor(low.x() - band)), static_cast<int>(std::floor(low.y() - band)),
          static_cast<int>(std::floor(high.x() + band)), static_cast<int>(std::floor(high.y() + band))};
}

/// Node positions on the far border belong to the last cell, not to one beyond the sheet.
int CellCoordinate(float x, int n) { return std::clamp(static_cast<int>(std::floor(x)), 0, n - 1); }

std::uint32_t CountBits(std::span<const std::uint8_t> bits) {
  std::uint32_t count = 0;
  for (const std::uint8_t byte : bits) count += static_cast<std::uint32_t>(std::popcount(byte));
  return count;
}

}  // namespace

MeshTopology::MeshTopology(const SheetScene& scene, const Sheet& sheet)
    : rows_(scene.membrane.rows),
      cols_(scene.membrane.cols),
      shrink_max_(scene.thermal.shrink_max),
      cell_m_(sheet.cell_m) {
  const std::size_t nodes = std::size_t{rows_} * cols_;
  node_.reserve(nodes);
  const Vec2f origin(static_cast<float>(sheet.origin_x), static_cast<float>(sheet.origin_y));
  for (const Vec2f& p : scene.membrane_material) node_.push_back(p / cell_m_ - origin);
  exists_.assign((3 * nodes + 7) / 8, 0);
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] > 0.0f) SetBit(exists_, e);
  }
  staged_.dead_nodes.assign((nodes + 7) / 8, 0);
  staged_.dead_edges.assign((3 * nodes + 7) / 8, 0);
  staged_.shrink.assign(3 * nodes, 0);
  committed_ = staged_;
  BuildBins(sheet);
}

bool MeshTopology::EdgeExists(Index edge) const { return TestBit(exists_, edge); }

Index MeshTopology::OtherEnd(Index edge) const {
  const Index node = edge / 3;
  switch (edge % 3) {
    case 0:
      return node + 1;
    case 1:
      return node + cols_;
    default:
      return node + cols_ + 1;
  }
}

void MeshTopology::BuildBins(const Sheet& sheet) {
  const auto for_tiles = [&](Index edge, const auto& visit) {
    if (!EdgeExists(edge)) return;
    const Box box = BoxOf(node_[edge / 3], node_[OtherEnd(edge)]);
    for (int ty = std::max(box.y0, 0) / kTile; ty <= std::min(box.y1, sheet.ny - 1) / kTile; ++ty) {
      for (int tx = std::max(box.x0, 0) / kTile; tx <= std::min(box.x1, sheet.nx - 1) / kTile; ++tx) {
        visit(ty * sheet.tiles_x + tx);
      }
    }
  };
  const Index edges = 3 * rows_ * cols_;
  bin_offset_.assign(sheet.tile_count() + 1, 0);
  for (Index e = 0; e < edges; ++e) for_tiles(e, [&](int tile) { ++bin_offset_[tile + 1]; });
  for (std::size_t i = 1; i < bin_offset_.size(); ++i) bin_offset_[i] += bin_offset_[i - 1];
  bin_edge_.resize(bin_offset_.back());
  std::vector<Index> next(bin_offset_.begin(), bin_offset_.end() - 1);
  for (Index e = 0; e < edges; ++e) for_tiles(e, [&](int tile) { bin_edge_[next[tile]++] = e; });
}

std::span<const Index> MeshTopology::EdgesAt(int tile_index) const {
  return std::span(bin_edge_).subspan(bin_offset_[tile_index], bin_offset_[tile_index + 1] - bin_offset_[tile_index]);
}

void MeshTopology::KillEdge(Index edge) {
  if (!EdgeExists(edge) || TestBit(staged_.dead_edges, edge)) return;
  SetBit(staged_.dead_edges, edge);
  ++dead_edge_count_;
  changed_ = true;
}

void MeshTopology::KillNode(Index node) {
  if (TestBit(staged_.dead_nodes, node)) return;
  SetBit(staged_.dead_nodes, node);
  ++dead_node_count_;
  changed_ = true;
  ForEdgesOfNode(node, [&](Index edge) {
    if (!EdgeExists(edge) || TestBit(staged_.dead_edges, edge)) return;
    KillEdge(edge);
    KillIfIsolated(edge / 3);
    KillIfIsolated(OtherEnd(edge));
  });
}

void MeshTopology::KillIfIsolated(Index node) {
  if (TestBit(staged_.dead_nodes, node)) return;
  bool attached = false;
  ForEdgesOfNode(node,
                 [&](Index edge) { attached = attached || (EdgeExists(edge) && !TestBit(staged_.dead_edges, edge)); });
  if (!attached) KillNode(node);
}

bool MeshTopology::Severed(const HeatField& field, Index edge) {
  if (HasPath(field, edge, {.holes = true, .outside = false})) return false;
  const bool resolved = HasPath(field, edge, {.holes = false, .outside = false});
  return resolved || !HasPath(field, edge, {.holes = true, .outside = true});
}

bool MeshTopology::HasPath(const HeatField& field, Index edge, const StrandRule& rule) {
  const Sheet& sheet = field.sheet();
  const Vec2f a = node_[edge / 3], b = node_[OtherEnd(edge)];
  Box box = BoxOf(a, b);
  box = {std::max(box.x0, 0), std::max(box.y0, 0), std::min(box.x1, sheet.nx - 1), std::min(box.y1, sheet.ny - 1)};
  const int width = box.x1 - box.x0 + 1, height = box.y1 - box.y0 + 1;
  const int start_x = CellCoordinate(a.x(), sheet.nx) - box.x0, start_y = CellCoordinate(a.y(), sheet.ny) - box.y0;
  const int goal_x = CellCoordinate(b.x(), sheet.nx) - box.x0, goal_y = CellCoordinate(b.y(), sheet.ny) - box.y0;

  // Marks the cells of the band that are tissue. The nodes' own cells belong to the band in spite of rounding.
  open_.assign(static_cast<std::size_t>(width) * height, 0);
  const Vec2f along = b - a;
  const float length2 = along.squaredNorm(), band2 = BandOf(a, b) * BandOf(a, b);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vec2f p(static_cast<float>(box.x0 + x) + 0.5f, static_cast<float>(box.y0 + y) + 0.5f);
      const float u = std::clamp((p - a).dot(along) / length2, 0.0f, 1.0f);
      const bool end = (x == start_x && y == start_y) || (x == goal_x && y == goal_y);
      if (!end && (p - a - u * along).squaredNorm() > band2) continue;
      const int ix = box.x0 + x, iy = box.y0 + y;
      if (!end && !rule.outside && sheet.IsOutside(ix, iy)) continue;
      const Tile* tile = rule.holes ? field.Find(ix / kTile, iy / kTile) : nullptr;
      const bool removed = tile != nullptr && (tile->state.flags[(iy % kTile) * kTile + ix % kTile] & kRemoved) != 0;
      open_[y * width + x] = removed ? 0 : 1;
    }
  }
  const int start = start_y * width + start_x, goal = goal_y * width + goal_x;
  if (open_[start] == 0 || open_[goal] == 0) return false;
  // Breadth-first search over faces, the connections through which heat and current flow.
  queue_.clear();
  queue_.push_back(start);
  open_[start] = 0;
  for (std::size_t head = 0; head < queue_.size(); ++head) {
    const int at = queue_[head];
    if (at == goal) return true;
    const int x = at % width, y = at / width;
    const auto enter = [&](bool inside, int next) {
      if (!inside || open_[next] == 0) return;
      open_[next] = 0;
      queue_.push_back(next);
    };
    enter(x > 0, at - 1);
    enter(x + 1 < width, at + 1);
    enter(y > 0, at - width);
    enter(y + 1 < height, at + width);
  }
  return false;
}

void MeshTopology::StageCut(const HeatField& field, CellIndex low, CellIndex high) {
  const Sheet& sheet = field.sheet();
  const Box cut{low.ix, low.iy, high.ix, high.iy};
  for (int ty = low.iy / kTile; ty <= high.iy / kTile; ++ty) {
    for (int tx = low.ix / kTile; tx <= high.ix / kTile; ++tx) {
      for (const Index edge : EdgesAt(ty * sheet.tiles_x + tx)) {
        const Index a = edge / 3, b = OtherEnd(edge);
        if (TestBit(staged_.dead_edges, edge) || !BoxOf(node_[a], node_[b]).Overlaps(cut)) continue;
        if (!Severed(field, edge)) continue;
        KillEdge(edge);
        for (const Index node : {a, b}) {
          const int ix = CellCoordinate(node_[node].x(), sheet.nx), iy = CellCoordinate(node_[node].y(), sheet.ny);
          const Tile* tile = field.Find(ix / kTile, iy / kTile);
          if (tile != nullptr && (tile->state.flags[(iy % kTile) * kTile + ix % kTile] & kRemoved) != 0) {
            KillNode(node);
          } else {
            KillIfIsolated(node);
          }
        }
      }
    }
  }
}

void MeshTopology::StageShrink(const HeatField& field, const Tile& tile) {
  const Sheet& sheet = field.sheet();
  for (const Index edge : EdgesAt(tile.index)) {
    if (TestBit(staged_.dead_edges, edge)) continue;
    const Vec2f a = node_[edge / 3], b = node_[OtherEnd(edge)];
    const int samples = std::max(2, static_cast<int>(std::ceil((b - a).norm())));
    float sum = 0;
    const Tile* at = &tile;
    int tx = tile.tx, ty = tile.ty;
    for (int n = 0; n < samples; ++n) {
      const Vec2f p = a + (b - a) * ((static_cast<float>(n) + 0.5f) / static_cast<float>(samples));
      const int ix = CellCoordinate(p.x(), sheet.nx), iy = CellCoordinate(p.y(), sheet.ny);
      if (ix / kTile != tx || iy / kTile != ty) at = field.Find(tx = ix / kTile, ty = iy / kTile);
      const float omega = at != nullptr ? at->state.omega_collagen[(iy % kTile) * kTile + ix % kTile] : 0.0f;
      if (omega > 0.0f) sum += 1.0f - std::exp(-omega);  // false for NaN, which must stay within its cell
    }
    const float lost = shrink_max_ * sum / static_cast<float>(samples);
    const int value = std::min(255, static_cast<int>(lost / kShrinkUnit)) / kShrinkStep * kShrinkStep;
    if (value > staged_.shrink[edge]) {
      staged_.shrink[edge] = static_cast<std::uint8_t>(value);
      changed_ = true;
    }
  }
}

void MeshTopology::Shorten(Index edge) {
  const float left = kInvalidShrink * (1.0f - kShrinkUnit * static_cast<float>(staged_.shrink[edge]));
  staged_.shrink[edge] = static_cast<std::uint8_t>(std::min(255L, std::lround((1.0f - left) / kShrinkUnit)));
  changed_ = true;
}

bool MeshTopology::Commit() {
  if (!changed_) return false;
  committed_ = staged_;
  changed_ = false;
  ++revision_;
  return true;
}

bool MeshTopology::Fits(const TopologyBits& bits) const {
  const std::size_t nodes = std::size_t{rows_} * cols_;
  if (bits.dead_nodes.size() != staged_.dead_nodes.size() || bits.dead_edges.size() != staged_.dead_edges.size() ||
      bits.shrink.size() != staged_.shrink.size()) {
    return false;
  }
  for (std::size_t bit = nodes; bit < 8 * bits.dead_nodes.size(); ++bit) {
    if (TestBit(bits.dead_nodes, bit)) return false;
  }
  for (std::size_t edge = 0; edge < 8 * bits.dead_edges.size(); ++edge) {
    const bool dead = TestBit(bits.dead_edges, edge);
    if (edge >= 3 * nodes || !TestBit(exists_, edge)) {
      if (dead || (edge < 3 * nodes && bits.shrink[edge] != 0)) return false;
      continue;
    }
    const auto index = static_cast<Index>(edge);
    if (!dead && (TestBit(bits.dead_nodes, index / 3) || TestBit(bits.dead_nodes, OtherEnd(index)))) return false;
  }
  return true;
}

void MeshTopology::Restore(std::uint64_t revision, const TopologyBits& bits) {
  staged_ = committed_ = bits;
  changed_ = false;
  revision_ = revision;
  dead_edge_count_ = CountBits(bits.dead_edges);
  dead_node_count_ = CountBits(bits.dead_nodes);
}

}  // namespace fulcrum::thermal
