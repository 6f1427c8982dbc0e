#include "services/records/log_tools/thinning.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fulcrum::log_tools {
namespace {

/// Neighbours clockwise from the upper one: P2 to P9 of Guo and Hall.
constexpr std::array<Pixel, 8> kRing{Pixel{0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}};

std::array<bool, 8> RingOf(const Mask& mask, int x, int y) {
  std::array<bool, 8> ring{};
  for (std::size_t i = 0; i < ring.size(); ++i) ring[i] = mask.At(x + kRing[i].x, y + kRing[i].y);
  return ring;
}

int CountOf(const std::array<bool, 8>& ring) { return static_cast<int>(std::count(ring.begin(), ring.end(), true)); }

/// Whether the connectivity of the set and the clear pixels around is unchanged without this pixel: its set
/// 8-neighbours are connected with each other (Yokoi's number is 1).
bool IsSimple(const std::array<bool, 8>& p) {
  int number = 0;
  for (std::size_t i = 0; i < p.size(); i += 2) {
    number += !p[i] && (p[i + 1] || p[(i + 2) % p.size()]) ? 1 : 0;
  }
  return number == 1;
}

/// One of the two passes; the remaining pixels stay in `pixels`. True if any pixel was removed.
bool Pass(Mask* mask, std::vector<Pixel>* pixels, bool first) {
  std::vector<Pixel> removed, kept;
  kept.reserve(pixels->size());
  for (const Pixel& at : *pixels) {
    const auto p = RingOf(*mask, at.x, at.y);
    // N of Guo and Hall: pairs of neighbours of which at least one is set, counted from both starting points.
    int even = 0, odd = 0;
    for (std::size_t i = 0; i < p.size(); i += 2) {
      even += p[i] || p[i + 1] ? 1 : 0;
      odd += p[i + 1] || p[(i + 2) % p.size()] ? 1 : 0;
    }
    const int pairs = std::min(even, odd);
    const bool needed = first ? (p[4] || p[5] || !p[7]) && p[6] : (p[0] || p[1] || !p[3]) && p[2];
    (IsSimple(p) && pairs >= 2 && pairs <= 3 && !needed ? removed : kept).push_back(at);
  }
  for (const Pixel& at : removed) mask->Put(at.x, at.y, false);
  pixels->swap(kept);
  return !removed.empty();
}

std::vector<Pixel> PixelsOf(const Mask& mask) {
  std::vector<Pixel> pixels;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.set[mask.Index(x, y)] != 0) pixels.push_back({x, y});
    }
  }
  return pixels;
}

/// Removes pixels that are not needed to keep pieces connected and are not ends of a line.
void RemoveSteps(Mask* mask) {
  for (const Pixel& at : PixelsOf(*mask)) {
    const auto ring = RingOf(*mask, at.x, at.y);
    if (CountOf(ring) >= 2 && IsSimple(ring)) mask->Put(at.x, at.y, false);
  }
}

/// Restores one pixel of each piece that was removed completely.
void RestoreLostPieces(const Mask& mask, std::span<const float> distance, Mask* thin) {
  const Pieces found = FindPieces(mask, true, Neighbours::kEight);
  std::vector<bool> kept(found.pieces.size());
  std::vector<std::size_t> deepest(found.pieces.size());
  for (std::size_t i = 0; i < mask.set.size(); ++i) {
    if (found.label[i] < 0) continue;
    const auto piece = static_cast<std::size_t>(found.label[i]);
    if (thin->set[i] != 0) kept[piece] = true;
    if (deepest[piece] == 0 || distance[i] > distance[deepest[piece]]) deepest[piece] = i;
  }
  for (std::size_t piece = 0; piece < kept.size(); ++piece) {
    if (!kept[piece]) thin->set[deepest[piece]] = 1;
  }
}

// ------------------------------------------------------------------------------------------------ tracing

class Tracer {
 public:
  Tracer(const Mask& thin, std::span<const float> distance) : thin_(thin) {
    Mask crossing(thin.width, thin.height);
    for (const Pixel& at : PixelsOf(thin)) {
      if (CountOf(RingOf(thin, at.x, at.y)) >= 3) crossing.Put(at.x, at.y);
    }
    Pieces clusters = FindPieces(crossing, true, Neighbours::kEight);
    junction_ = std::move(clusters.label);
    skeleton_.junctions.resize(clusters.pieces.size());
    for (const Pixel& at : PixelsOf(crossing)) {
      const std::size_t i = thin.Index(at.x, at.y);
      const auto number = static_cast<std::size_t>(junction_[i]);
      Junction& junction = skeleton_.junctions[number];
      junction.centre += Vec2d(at.x + 0.5, at.y + 0.5) / clusters.pieces[number].pixels;
      junction.half_width = std::max(junction.half_width, distance[i]);
    }
    seen_.assign(thin.set.size(), false);
  }

  Skeleton Run() {
    const std::vector<Pixel> pixels = PixelsOf(thin_);
    for (const Pixel& at : pixels) {
      if (JunctionAt(at) < 0) continue;
      for (const Pixel& step : kRing) Follow({at.x + step.x, at.y + step.y}, JunctionAt(at));
    }
    for (const Pixel& at : pixels) {
      if (CountOf(RingOf(thin_, at.x, at.y)) <= 1) Follow(at, Branch::kFree);
    }
    for (const Pixel& at : pixels) {
      if (!Follow(at, Branch::kFree)) continue;
      skeleton_.branches.back().closed = true;
    }
    return std::move(skeleton_);
  }

 private:
  [[nodiscard]] int JunctionAt(const Pixel& at) const { return junction_[thin_.Index(at.x, at.y)]; }

  /// Adds the branch that starts at pixel `at`; false if that pixel belongs to a branch already.
  bool Follow(Pixel at, int from) {
    if (!IsNew(at)) return false;
    Branch branch;
    branch.from = from;
    for (;;) {
      seen_[thin_.Index(at.x, at.y)] = true;
      branch.pixels.push_back(at);
      const Pixel* next = nullptr;
      int to = Branch::kFree;
      for (const Pixel& step : kRing) {
        const Pixel beside{at.x + step.x, at.y + step.y};
        if (!thin_.At(beside.x, beside.y)) continue;
        if (IsNew(beside)) next = &step;
        // Near its own junction a branch has only begun.
        const int junction = JunctionAt(beside);
        if (junction >= 0 && (junction != from || branch.pixels.size() > 2)) to = junction;
      }
      if (to != Branch::kFree || next == nullptr) {
        branch.to = to;
        break;
      }
      at = {at.x + next->x, at.y + next->y};
    }
    skeleton_.branches.push_back(std::move(branch));
    return true;
  }

  [[nodiscard]] bool IsNew(const Pixel& at) const {
    return thin_.At(at.x, at.y) && JunctionAt(at) < 0 && !seen_[thin_.Index(at.x, at.y)];
  }

  const Mask& thin_;
  std::vector<int> junction_;
  std::vector<bool> seen_;
  Skeleton skeleton_;
};

Vec2d CentreOf(const Pixel& at) { return {at.x + 0.5, at.y + 0.5}; }

/// A branch extends beyond the edge of the hole beside it by more than the width of the hole there, which is three half
/// widths from its middle: a shorter extension is a bay of the edge.
constexpr double kRough = 3;

}  // namespace

Mask Thinned(const Mask& mask, std::span<const float> distance) {
  Mask thin = mask;
  std::vector<Pixel> pixels = PixelsOf(thin);
  for (bool changed = true; changed;) {
    changed = Pass(&thin, &pixels, true);
    changed |= Pass(&thin, &pixels, false);
  }
  RestoreLostPieces(mask, distance, &thin);
  RemoveSteps(&thin);
  return thin;
}

Skeleton Trace(const Mask& thin, std::span<const float> distance) { return Tracer(thin, distance).Run(); }

double LengthOf(const Branch& branch, const Skeleton& skeleton) {
  double length = 0;
  for (std::size_t i = 1; i < branch.pixels.size(); ++i) {
    length += (CentreOf(branch.pixels[i]) - CentreOf(branch.pixels[i - 1])).norm();
  }
  if (branch.closed) length += (CentreOf(branch.pixels.front()) - CentreOf(branch.pixels.back())).norm();
  const auto junction = [&](int number) { return skeleton.junctions[static_cast<std::size_t>(number)].centre; };
  if (branch.from >= 0) length += (junction(branch.from) - CentreOf(branch.pixels.front())).norm();
  if (branch.to >= 0) length += (junction(branch.to) - CentreOf(branch.pixels.back())).norm();
  return length;
}

double ExcessOf(const Branch& branch, const Skeleton& skeleton, std::span<const float> distance, const Mask& thin,
                double beyond) {
  const Pixel end = branch.pixels.back();
  const double reach = LengthOf(branch, skeleton) + static_cast<double>(distance[thin.Index(end.x, end.y)]);
  const double edge = static_cast<double>(skeleton.junctions[static_cast<std::size_t>(branch.from)].half_width);
  return reach - kRough * edge - beyond;
}

void PruneSpurs(Mask* thin, std::span<const float> distance, double beyond) {
  for (bool changed = true; changed;) {
    changed = false;
    const Skeleton skeleton = Trace(*thin, distance);
    struct Spur {
      double excess;
      const Branch* branch;
    };
    std::vector<std::vector<Spur>> spurs(skeleton.junctions.size());
    std::vector<std::size_t> degree(skeleton.junctions.size());
    for (const Branch& branch : skeleton.branches) {
      for (const int junction : {branch.from, branch.to}) {
        if (junction >= 0) ++degree[static_cast<std::size_t>(junction)];
      }
      if (branch.from < 0 || branch.to >= 0) continue;
      const auto junction = static_cast<std::size_t>(branch.from);
      const double excess = ExcessOf(branch, skeleton, distance, *thin, beyond);
      if (excess < 0) spurs[junction].push_back({excess, &branch});
    }
    for (std::size_t junction = 0; junction < spurs.size(); ++junction) {
      auto& here = spurs[junction];
      std::sort(here.begin(), here.end(), [](const Spur& a, const Spur& b) { return a.excess < b.excess; });
      // Two stay at each junction: they form the line.
      here.resize(std::min(here.size(), std::max<std::size_t>(degree[junction], 2) - 2));
      for (const Spur& spur : here) {
        for (const Pixel& at : spur.branch->pixels) thin->Put(at.x, at.y, false);
        changed = true;
      }
    }
    if (changed) RemoveSteps(thin);
  }
}

}  // namespace fulcrum::log_tools
