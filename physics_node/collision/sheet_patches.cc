#include "physics_node/collision/sheet_patches.h"

#include <algorithm>
#include <cmath>

#include "physics_node/simd/limits.h"

namespace fulcrum::physics {
namespace {

/// Spread of the normals of two patches from which on they may face each other: 150 degrees. Areas in contact face each
/// other at nearly 180, and the edge of a curl that touches itself has turned by more than that.
constexpr float kCosFolded = -0.866f, kCosHalfFolded = 0.259f;
/// Boxes nearer than the reach and this are a pair [m]: else patches at rest just beyond the reach would be evaluated
/// in each step in which they tremble.
constexpr float kCloseSlack = 0.0003f;
/// Steps after which the cone of a patch that has moved by kTurn is fitted anew [1], [m]. A quick fold of 5 mm takes
/// some 30 steps.
constexpr std::uint32_t kConePeriod = 8;
constexpr float kTurn = 0.0002f;
/// More patches than this are made larger instead: an evaluation compares one with all others. Assumed.
constexpr std::size_t kMostPatches = 512;
/// More pairs than this are crumpled or scrambled tissue; further ones are not searched. Assumed.
constexpr std::size_t kMostPairs = 4096;
/// Least share of a patch in the room between two.
constexpr float kLeastShare = 0.1f;
/// Squared area below which a normal has no direction [m^4].
constexpr float kNoArea = 1e-20f;

}  // namespace

bool SheetPatches::Cone::Faces(const Cone& other) const {
  if (wide || other.wide) return true;
  float cosine = std::clamp(axis.dot(other.axis), -1.0f, 1.0f), sine = std::sqrt(1.0f - cosine * cosine);
  for (const Cone* cone : {this, &other}) {
    const float next = cosine * cone->cos_half - sine * cone->sin_half;
    sine = sine * cone->cos_half + cosine * cone->sin_half;
    cosine = next;
    if (sine < 0.0f || cosine <= kCosFolded) return true;
  }
  return false;
}

SheetPatches::SheetPatches(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles,
                           float distance)
    : model_(model),
      particles_(particles),
      cols_(scene.membrane.cols),
      reach_(distance + 2 * kSearchTravel),
      sheet_of_row_(SheetOfRows(scene)) {
  const std::vector<SheetPart> parts = SheetsOf(scene);
  const auto across = [this](std::uint32_t nodes) { return nodes > 1 ? (nodes - 2) / cells_ + 1 : 0; };
  const auto count = [&] {
    std::size_t sum = 0;
    for (const SheetPart& part : parts) sum += std::size_t{across(part.rows)} * across(part.cols);
    return sum;
  };
  while (count() > kMostPatches) cells_ *= 2;
  for (const SheetPart& part : parts) {
    sheets_.push_back({part.first_row, part.rows, part.cols, across(part.rows), across(part.cols),
                       static_cast<Index>(patches_.size())});
    MakePatches(sheets_.back());
  }
  for (auto* of_axis : {&low_, &high_}) {
    for (std::vector<float>& bounds : *of_axis) bounds.assign(patches_.size(), 0.0f);
  }
  for (std::vector<float>* values : {&age_, &step_, &room_, &gap_}) values->assign(patches_.size(), 0.0f);
  strip_moved_.resize(strips_.size());
  Restart();
}

void SheetPatches::MakePatches(const Sheet& sheet) {
  const std::uint32_t slots = particles_->layout().slots;
  for (std::uint32_t r = 0; r < sheet.patch_rows; ++r) {
    const std::uint32_t row0 = sheet.first_row + r * cells_;
    const std::uint32_t row1 = std::min(row0 + cells_, sheet.first_row + sheet.rows - 1);
    strips_.push_back({row0, row1, 0, sheet.cols - 1});
    for (std::uint32_t c = 0; c < sheet.patch_cols; ++c) {
      Patch& patch = patches_.emplace_back();
      patch.area = {row0, row1, c * cells_, std::min((c + 1) * cells_, sheet.cols - 1)};
      patch.strip = static_cast<std::uint32_t>(strips_.size()) - 1;
      patch.lane0 = patch.area.col0 / slots;
      patch.lane1 = patch.area.col1 / slots;
      for (std::uint32_t row = row0; row < row1; row += kTileCells) {
        for (std::uint32_t col = patch.area.col0; col < patch.area.col1; col += kTileCells) {
          Tile& tile = patch.tiles.emplace_back();
          tile.area = {row, std::min(row + kTileCells, row1), col, std::min(col + kTileCells, patch.area.col1)};
          const std::uint32_t last_row = sheet.first_row + sheet.rows - 1, last_col = sheet.cols - 1;
          tile.row_end = tile.area.row1 == last_row ? last_row + 1 : tile.area.row1;
          tile.col_end = tile.area.col1 == last_col ? last_col + 1 : tile.area.col1;
        }
      }
      patch.adjoining.fill(kNoIndex);
      std::size_t n = 0;
      for (std::uint32_t rr = r > 0 ? r - 1 : 0; rr <= std::min(r + 1, sheet.patch_rows - 1); ++rr) {
        for (std::uint32_t cc = c > 0 ? c - 1 : 0; cc <= std::min(c + 1, sheet.patch_cols - 1); ++cc) {
          patch.adjoining[n++] = sheet.first_patch + rr * sheet.patch_cols + cc;
        }
      }
    }
  }
}

Index SheetPatches::Of(std::uint32_t row, std::uint32_t col) const {
  const Sheet& sheet = sheets_[sheet_of_row_[row]];
  const std::uint32_t r = std::min((row - sheet.first_row) / cells_, sheet.patch_rows - 1);
  return sheet.first_patch + r * sheet.patch_cols + std::min(col / cells_, sheet.patch_cols - 1);
}

SheetPatches::Box SheetPatches::FitBox(const Area& area) const {
  Box box;
  for (std::uint32_t row = area.row0; row <= area.row1; ++row) {
    for (std::uint32_t col = area.col0; col <= area.col1; ++col) {
      if (!Alive(row, col)) continue;
      const Vec3f p = At(row, col);
      box.low = box.low.cwiseMin(p);
      box.high = box.high.cwiseMax(p);
    }
  }
  return box;
}

/// Of the normals of quads of 2 x 2 cells: a fold that is tighter is no contact.
SheetPatches::Cone SheetPatches::FitCone(const Area& area) const {
  Cone cone;
  const auto for_normals = [&](const auto& body) {
    for (std::uint32_t r = area.row0; r < area.row1; r += 2) {
      const std::uint32_t r1 = std::min(r + 2, area.row1);
      for (std::uint32_t c = area.col0; c < area.col1; c += 2) {
        const std::uint32_t c1 = std::min(c + 2, area.col1);
        if (!Alive(r, c) || !Alive(r, c1) || !Alive(r1, c) || !Alive(r1, c1)) continue;
        body(Vec3f((At(r1, c1) - At(r, c)).cross(At(r1, c) - At(r, c1))));
      }
    }
  };
  Vec3f sum = Vec3f::Zero();
  for_normals([&](const Vec3f& n) {
    const float area_sq = n.squaredNorm();
    if (area_sq > kNoArea) {
      sum += n / std::sqrt(area_sq);
    } else {
      cone.wide = true;
    }
  });
  const float length = sum.norm();
  if (!(length > 0.0f)) {
    cone.wide = cone.wide || sum != Vec3f::Zero();
    return cone;
  }
  cone.axis = sum / length;
  for_normals([&](const Vec3f& n) {
    const float norm = n.norm();
    if (norm > 0.0f) cone.cos_half = std::min(cone.cos_half, cone.axis.dot(n) / norm);
  });
  cone.wide = cone.wide || !(cone.cos_half > kCosHalfFolded);
  cone.sin_half = cone.wide ? 0.0f : std::sqrt(std::max(1.0f - cone.cos_half * cone.cos_half, 0.0f));
  return cone;
}

void SheetPatches::Fit(Index patch) {
  const Box box = FitBox(patches_[patch].area);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low_[axis][patch] = box.low[static_cast<int>(axis)];
    high_[axis][patch] = box.high[static_cast<int>(axis)];
  }
  age_[patch] = 0.0f;
}

std::span<const SheetPatches::Tile> SheetPatches::Tiles(Index patch) {
  Patch& of = patches_[patch];
  if (of.tiles_step != steps_) {
    of.tiles_step = steps_;
    for (Tile& tile : of.tiles) {
      tile.box = FitBox(tile.area);
      tile.cone = FitCone(tile.area);
    }
  }
  return of.tiles;
}

bool SheetPatches::Keep(Index a, Index b, bool adjoins) {
  std::vector<Pair>& pairs = patches_[std::min(a, b)].pairs;
  const Index other = std::max(a, b);
  const bool known = std::any_of(pairs.begin(), pairs.end(), [&](const Pair& pair) { return pair.other == other; });
  if (known) return true;
  if (pair_count_ >= kMostPairs) return false;
  pairs.push_back({.other = other, .adjoins = adjoins});
  ++pair_count_;
  return true;
}

void SheetPatches::Drop(Index a, Index b) {
  std::vector<Pair>& pairs = patches_[std::min(a, b)].pairs;
  const auto at = std::find_if(pairs.begin(), pairs.end(), [&](const Pair& p) { return p.other == std::max(a, b); });
  if (at != pairs.end()) RemovePair(std::min(a, b), static_cast<std::size_t>(at - pairs.begin()));
}

void SheetPatches::RemovePair(Index a, std::size_t at) {
  patches_[a].pairs.erase(patches_[a].pairs.begin() + static_cast<std::ptrdiff_t>(at));
  --pair_count_;
}

/// Distance of a patch from all that do not adjoin it: pairs, and its room among the others.
void SheetPatches::Evaluate(Index patch) {
  Fit(patch);
  const std::size_t n = patches_.size();
  float lo[3], hi[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lo[axis] = low_[axis][patch];
    hi[axis] = high_[axis][patch];
  }
  for (std::size_t j = 0; j < n; ++j) {
    float sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float apart = std::max(std::max(low_[axis][j] - hi[axis], lo[axis] - high_[axis][j]), 0.0f);
      sum += apart * apart;
    }
    gap_[j] = std::sqrt(sum) - age_[j] - reach_;
  }
  for (const Index j : patches_[patch].adjoining) {
    if (j != kNoIndex) gap_[j] = kLargestFinite;
  }
  if (!within_) {
    const Sheet& sheet = sheets_[SheetOf(patches_[patch].area.row0)];
    std::fill_n(gap_.begin() + sheet.first_patch, std::size_t{sheet.patch_rows} * sheet.patch_cols, kLargestFinite);
  }
  for (Index j = 0; j < n; ++j) {
    if (gap_[j] < kCloseSlack) {
      if (age_[j] > 0.0f) {
        Fit(j);
        const Box own{Vec3f(lo[0], lo[1], lo[2]), Vec3f(hi[0], hi[1], hi[2])};
        const Box other{Vec3f(low_[0][j], low_[1][j], low_[2][j]), Vec3f(high_[0][j], high_[1][j], high_[2][j])};
        gap_[j] = std::sqrt(own.DistanceSq(other)) - reach_;
      }
      if (gap_[j] < kCloseSlack) {
        gap_[j] = Keep(patch, j, false) ? kLargestFinite : 0.0f;
      }
    }
  }
  float room = kLargestFinite;
  const float own = step_[patch];
  for (std::size_t j = 0; j < n; ++j) {
    const float both = own + step_[j];
    const float share = both > 0.0f ? std::clamp(own / both, kLeastShare, 1.0f - kLeastShare) : 0.5f;
    room = std::min(room, share * gap_[j]);
    room_[j] = std::min(room_[j], (1.0f - share) * gap_[j]);
  }
  room_[patch] = room;
}

bool SheetPatches::StaysClose(Index a, const Pair& pair) {
  if (pair.adjoins) return true;
  const Index b = pair.other;
  Fit(a);
  Fit(b);
  float sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float apart = std::max(std::max(low_[axis][a] - high_[axis][b], low_[axis][b] - high_[axis][a]), 0.0f);
    sum += apart * apart;
  }
  // Twice the slack: a pair at the border is not added and removed in turns.
  const float gap = std::sqrt(sum) - reach_;
  if (gap < 2 * kCloseSlack) return true;
  room_[a] = std::min(room_[a], 0.5f * gap);
  room_[b] = std::min(room_[b], 0.5f * gap);
  return false;
}

/// Fits the cone of a patch: pairs with those that adjoin it.
void SheetPatches::FindFolds(Index patch) {
  if (!within_) return;
  Patch& of = patches_[patch];
  of.cone = FitCone(of.area);
  of.turned = 0.0f;
  for (const Index j : of.adjoining) {
    if (j == kNoIndex) continue;
    if (of.cut || patches_[j].cut || of.cone.Faces(patches_[j].cone)) {
      Keep(patch, j, true);
    } else {
      Drop(patch, j);
    }
  }
}

void SheetPatches::Restart() {
  if (sheets_.size() < 2 && !within_) return;  // No pair is possible.
  std::fill(step_.begin(), step_.end(), 0.0f);
  std::fill(room_.begin(), room_.end(), kLargestFinite);
  pair_count_ = 0;
  ++steps_;
  for (Index i = 0; i < count(); ++i) {
    Patch& patch = patches_[i];
    patch.pairs.clear();
    patch.turned = 0.0f;
    patch.cone = FitCone(patch.area);
    Fit(i);
  }
  for (Index i = 0; i < count(); ++i) {
    Evaluate(i);
    FindFolds(i);
  }
}

void SheetPatches::Follow(std::span<const Index> edited_edges) {
  if (sheets_.size() < 2 && !within_) return;
  edited_.assign(patches_.size(), 0);
  const auto mark = [&](std::uint32_t row, std::uint32_t col) {
    const std::size_t sheet = sheet_of_row_[row];
    if (row >= sheets_[sheet].first_row + sheets_[sheet].rows || col >= sheets_[sheet].cols) return;
    for (const Index i : patches_[Of(row, col)].adjoining) {
      if (i == kNoIndex) continue;
      edited_[i] = 1;
      for (Tile& tile : patches_[i].tiles) {
        const Area& area = tile.area;
        if (row >= area.row0 && row <= area.row1 && col >= area.col0 && col <= area.col1) {
          tile.cut = patches_[i].cut = true;
        }
      }
    }
  };
  for (const Index edge : edited_edges) {
    const Index node = edge / 3;
    const int direction = static_cast<int>(edge % 3);
    if (model_->EdgeAlive(node, direction)) continue;  // It has shrunk.
    const std::uint32_t row = node / cols_, col = node % cols_;
    mark(row, col);
    mark(std::min(row + (direction > 0 ? 1 : 0), model_->rows() - 1),
         std::min(col + (direction != 1 ? 1 : 0), cols_ - 1));
  }
  for (Index i = 0; i < count(); ++i) {
    if (patches_[i].cut) FindFolds(i);
    // A contact ends with its triangle: its node may touch what is left.
    for (Pair& pair : patches_[i].pairs) pair.fresh = pair.fresh || edited_[i] != 0 || edited_[pair.other] != 0;
  }
}

void SheetPatches::Move(std::span<const float> moved) {
  constexpr std::uint32_t kLanesOfRow = ParticleStore::kBlocksPerRow;
  ++steps_;
  const float* of_rows = moved.data() + particles_->tube_blocks();
  for (std::size_t s = 0; s < strips_.size(); ++s) {
    std::array<float, kLanesOfRow>& most = strip_moved_[s];
    most.fill(0.0f);
    for (std::uint32_t row = strips_[s].row0; row <= strips_[s].row1; ++row) {
      for (std::uint32_t lane = 0; lane < kLanesOfRow; ++lane) {
        most[lane] = std::max(most[lane], of_rows[row * kLanesOfRow + lane]);
      }
    }
  }
  moving_ = false;
  for (Index i = 0; i < count(); ++i) {
    Patch& patch = patches_[i];
    float step = 0;
    for (std::uint32_t lane = patch.lane0; lane <= patch.lane1; ++lane) {
      step = std::max(step, strip_moved_[patch.strip][lane]);
    }
    step_[i] = step;
    age_[i] += step;
    room_[i] -= step;
    patch.turned += step;
    moving_ = moving_ || step > 0.0f;
  }
  if (!moving_) return;
  for (Index i = 0; i < count(); ++i) {
    for (Pair& pair : patches_[i].pairs) pair.moved += step_[i] + step_[pair.other];
    if (step_[i] > 0.0f && room_[i] <= kFaster * step_[i]) Evaluate(i);
    if (patches_[i].turned > kTurn && (i + steps_) % kConePeriod == 0) FindFolds(i);
  }
}

}  // namespace fulcrum::physics
