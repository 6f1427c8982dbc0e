// Pairs and rows; the search for pairs is in sheet_search.cc.
#include "physics_node/collision/sheet_collision.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/closest.h"

namespace fulcrum::physics {
namespace {

/// Rows are made within this distance beyond contact, and the movement of the step [m].
constexpr float kRowBand = 0.0002f;
/// A pair ends when it is this far apart, beyond the reach of the search, and so deep behind its triangle that the node
/// has passed through it: a row would pull it back across tissue that it has left [m].
constexpr float kFarther = 0.0005f, kMaxBehind = 0.001f;
/// Nearer than this to the triangle a row acts along its normal: the direction to the nearest point is rounding [m].
constexpr float kTouching = 0.00002f;
/// Beside a rim: the offset from the nearest point, on an edge, has less than this share along the normal.
constexpr float kBesideRimCosine = 0.5f;
/// A triangle whose normal has less than this share along the mean normal around it is turned over.
constexpr float kTurnedCosine = 0.3f;
/// Most steps of a walk along the sheet in one step.
constexpr int kMostWalk = 4;
/// Twice the area below which a triangle has no normal [m^2].
constexpr float kNoArea = 1e-12f;

float LargestThickness(const TissueScene& scene) {
  float largest = 0;
  for (const SheetPart& sheet : SheetsOf(scene)) {
    largest = std::max(largest, sheet.thickness_m > 0.0f ? sheet.thickness_m : scene.thermal.thickness_m);
  }
  return largest;
}

}  // namespace

SheetCollision::SheetCollision(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene),
      model_(model),
      particles_(particles),
      cols_(std::max(scene.membrane.cols, 2u)),
      exists_(std::size_t{scene.membrane.rows} * (cols_ - 1), 0),
      patches_(scene, model, particles, LargestThickness(scene)) {
  for (const SheetPart& sheet : SheetsOf(scene)) {
    half_thickness_.push_back(0.5f * (sheet.thickness_m > 0.0f ? sheet.thickness_m : scene.thermal.thickness_m));
    for (std::uint32_t row = sheet.first_row; row + 1 < sheet.first_row + sheet.rows; ++row) {
      std::fill_n(exists_.begin() + std::size_t{row} * (cols_ - 1), sheet.cols - 1, std::uint8_t{1});
    }
  }
  Restart();
}

void SheetCollision::Restart() {
  patches_.Restart();
  watches_.clear();
  cursor_ = 0;
  unsearched_ = true;
}

std::uint32_t SheetCollision::CellsBetween(Index node, std::uint32_t row, std::uint32_t col) const {
  const std::uint32_t r = node / cols_, c = node % cols_;
  if (patches_.SheetOf(r) != patches_.SheetOf(row)) return kNoIndex;
  const auto apart = [](std::uint32_t at, std::uint32_t cell) {
    return at < cell ? cell - at : at > cell + 1 ? at - cell - 1 : 0;
  };
  return std::max(apart(r, row), apart(c, col));
}

/// Whether live edges join the node with the triangle within kNeighbourCells around the node.
bool SheetCollision::Joined(Index node, Index triangle) const {
  constexpr int kRadius = static_cast<int>(kNeighbourCells) + 1, kSide = 2 * kRadius + 1;
  const int row = static_cast<int>(node / cols_), col = static_cast<int>(node % cols_);
  const std::array<Index, 3> goal = model_->TriangleNodes(triangle);
  std::array<bool, static_cast<std::size_t>(kSide) * kSide> seen{};
  std::array<std::pair<int, int>, static_cast<std::size_t>(kSide) * kSide> queue;
  std::size_t count = 0;
  const auto reach = [&](int r, int c) {
    bool& at = seen[static_cast<std::size_t>((r + kRadius) * kSide + c + kRadius)];
    if (!at) queue[count++] = {r, c};
    at = true;
  };
  reach(0, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const auto [r, c] = queue[i];
    const Index here = static_cast<Index>(row + r) * cols_ + static_cast<Index>(col + c);
    if (std::find(goal.begin(), goal.end(), here) != goal.end()) return true;
    constexpr std::array<std::array<int, 2>, 3> kAway{{{0, 1}, {1, 0}, {1, 1}}};
    for (int d = 0; d < 3; ++d) {
      for (const int sign : {1, -1}) {
        const int dr = sign * kAway[static_cast<std::size_t>(d)][0], dc = sign * kAway[static_cast<std::size_t>(d)][1];
        const int to_r = row + r + dr, to_c = col + c + dc;
        if (std::abs(r + dr) > kRadius || std::abs(c + dc) > kRadius || to_r < 0 || to_c < 0 ||
            to_r >= static_cast<int>(model_->rows()) || to_c >= static_cast<int>(cols_)) {
          continue;
        }
        const Index from = sign > 0 ? here : static_cast<Index>(to_r) * cols_ + static_cast<Index>(to_c);
        if (model_->EdgeAlive(from, d)) reach(r + dr, c + dc);
      }
    }
  }
  return false;
}

SheetCollision::Foot SheetCollision::FootOf(const Vec3f& p, Index triangle) const {
  const std::array<Index, 3> nodes = model_->TriangleNodes(triangle);
  const Vec3f a = Node(nodes[0]), b = Node(nodes[1]), c = Node(nodes[2]);
  Foot foot;
  foot.barycentric = ClosestOnTriangle(p, a, b, c);
  foot.offset = p - foot.barycentric[0] * a - foot.barycentric[1] * b - foot.barycentric[2] * c;
  foot.distance_sq = foot.offset.squaredNorm();
  const Vec3f normal = (b - a).cross(c - a);
  const float area = normal.norm();
  if (area > kNoArea) foot.normal = normal / area;
  return foot;
}

bool SheetCollision::PastRim(const Foot& foot) {
  const float height = foot.normal.dot(foot.offset);
  return foot.OnEdge() && height * height < kBesideRimCosine * kBesideRimCosine * foot.distance_sq;
}

Vec3f SheetCollision::NormalAround(Index triangle) const {
  const std::uint32_t row = RowOf(triangle), col = ColOf(triangle);
  Vec3f sum = Vec3f::Zero();
  for (std::uint32_t r = row > 0 ? row - 1 : 0; r <= std::min(row + 1, model_->rows() - 2); ++r) {
    for (std::uint32_t c = col > 0 ? col - 1 : 0; c <= std::min(col + 1, cols_ - 2); ++c) {
      const Index cell = r * (cols_ - 1) + c;
      if (!Exists(2 * cell) || !Exists(2 * cell + 1)) continue;
      sum += (patches_.At(r + 1, c + 1) - patches_.At(r, c)).cross(patches_.At(r + 1, c) - patches_.At(r, c + 1));
    }
  }
  return sum;
}

bool SheetCollision::TurnedOver(const Foot& foot, Index triangle) const {
  const Vec3f around = NormalAround(triangle);
  return !(foot.normal.dot(around) > kTurnedCosine * around.norm());
}

void SheetCollision::SetTriangle(Watch* watch, Index triangle) const {
  watch->triangle = triangle;
  watch->other = patches_.Of(RowOf(triangle), ColOf(triangle));
  const Index first = scene_.membrane.first;
  const std::array<Index, 3> nodes = model_->TriangleNodes(triangle);
  watch->at = {particles_->Ref(first + watch->node), particles_->Ref(first + nodes[0]),
               particles_->Ref(first + nodes[1]), particles_->Ref(first + nodes[2])};
}

/// Along the sheet to the triangle nearest to p.
SheetCollision::Foot SheetCollision::Walk(Watch* watch, const Vec3f& p) const {
  Foot best = FootOf(p, watch->triangle);
  Index at = watch->triangle;
  for (int step = 0; step < kMostWalk && best.OnEdge(); ++step) {
    const Index from = at;
    const std::uint32_t row = RowOf(from), col = ColOf(from);
    for (std::uint32_t r = row > 0 ? row - 1 : 0; r <= std::min(row + 1, model_->rows() - 2); ++r) {
      for (std::uint32_t c = col > 0 ? col - 1 : 0; c <= std::min(col + 1, cols_ - 2); ++c) {
        const Index cell = r * (cols_ - 1) + c;
        for (const Index triangle : {2 * cell, 2 * cell + 1}) {
          if (triangle == from || !Exists(triangle)) continue;
          const Foot foot = FootOf(p, triangle);
          if (foot.distance_sq < best.distance_sq) {
            best = foot;
            at = triangle;
          }
        }
      }
    }
    if (at == from) break;
  }
  if (at != watch->triangle) SetTriangle(watch, at);
  return best;
}

bool SheetCollision::Update(Watch* watch) const {
  const std::uint32_t row = watch->node / cols_, col = watch->node % cols_;
  if (!patches_.Alive(row, col) || !Exists(watch->triangle)) return false;
  const float step = patches_.step(watch->patch) + patches_.step(watch->other);
  if (!(step > 0.0f)) return true;
  const Vec3f p = Node(watch->node);
  const Index before = watch->triangle;
  const Foot foot = Walk(watch, p);
  if (watch->triangle != before &&
      CellsBetween(watch->node, RowOf(watch->triangle), ColOf(watch->triangle)) < kNeighbourCells &&
      Joined(watch->node, watch->triangle)) {
    return false;
  }
  const float height = watch->side * foot.normal.dot(foot.offset), distance = std::sqrt(foot.distance_sq);
  const bool past_rim = distance > kTouching && PastRim(foot);
  if (height < -kMaxBehind || distance > watch->distance + SheetPatches::kSearchTravel + kFarther ||
      (past_rim && distance > watch->clearance)) {
    return false;
  }
  Refresh(foot, watch);
  return true;
}

void SheetCollision::Refresh(const Foot& foot, Watch* watch) const {
  const float height = watch->side * foot.normal.dot(foot.offset), distance = std::sqrt(foot.distance_sq);
  const bool past_rim = distance > kTouching && PastRim(foot);
  watch->band = kRowBand + SheetPatches::kFaster * (patches_.step(watch->patch) + patches_.step(watch->other));
  watch->blocks = !past_rim && distance < watch->clearance + watch->band && !TurnedOver(foot, watch->triangle);
  if (!past_rim && height > 0.0f) {
    watch->clearance = std::max(watch->clearance, std::min(watch->distance, distance));
  }
}

void SheetCollision::FindPairs(std::span<const float> moved) {
  if (pairs_ == SheetPairs::kNone || (pairs_ == SheetPairs::kBetweenSheets && half_thickness_.size() < 2)) return;
  patches_.Move(moved);
  if (!patches_.moving() && !unsearched_) return;
  std::erase_if(watches_, [this](Watch& watch) { return !Update(&watch); });
  DropRepeated(&watches_);
  found_.clear();
  unsearched_ = !SearchPairs();
  MergeFound();
}

void SheetCollision::FindRows(float part) {
  rows_.clear();
  for (std::size_t i = 0; i < watches_.size() && rows_.size() < kMaxRows; ++i) {
    const Watch& watch = watches_[i];
    if (!watch.blocks) continue;
    const Foot foot = FootOf(particles_->At(watch.at[0]), watch.triangle);
    const float distance = std::sqrt(foot.distance_sq), height = watch.side * foot.normal.dot(foot.offset);
    if (distance > watch.clearance + part * watch.band || foot.normal == Vec3f::Zero() ||
        (distance > kTouching && PastRim(foot))) {
      continue;
    }
    ContactRow& row = rows_.emplace_back();
    row.count = 4;
    row.at = watch.at;
    row.weight = {1.0f, -foot.barycentric[0], -foot.barycentric[1], -foot.barycentric[2]};
    row.normal =
        height > 0.0f && distance > kTouching ? Vec3f(foot.offset / distance) : Vec3f(watch.side * foot.normal);
    row.offset = watch.clearance;
    row.friction = kFriction;
    row.source = TissueCollision::kSource | kSheetSource | static_cast<std::uint32_t>(i);
  }
}

}  // namespace fulcrum::physics
