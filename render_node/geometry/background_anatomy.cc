#include "render_node/geometry/background_anatomy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "services/base/core/scope.h"

namespace fulcrum::render {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Loops of small bowel.
constexpr float kThinnest_m = 0.0125f, kThickest_m = 0.0175f;  // Radius.
constexpr float kStep_m = 0.006f;                              // Between rings.
constexpr float kPressed_m = 0.0015f;                          // Neighbours flatten each other by this.
constexpr std::size_t kFewestRings = 17, kMostRings = 60, kMostRingsOfAll = 380;
constexpr std::size_t kFewestRingsOfCord = 5, kMostRingsOfCord = 14, kMostRingsOfFat = 90;
constexpr float kThinnestCord_m = 0.008f;
constexpr float kFatPressed = 0.55f;   // Fat fills clefts: share of its radius that lies inside the loops.
constexpr float kMostDrop_m = 0.035f;  // Between a loop and what it lies on.
constexpr int kSides = 12;

constexpr std::size_t kMostTubes =
    (kMostRingsOfAll + kMostRings) / kFewestRings + (kMostRingsOfFat + kMostRingsOfCord) / kFewestRingsOfCord;
static_assert(2 * kSides * (kMostRingsOfAll + kMostRings + kMostRingsOfFat + kMostRingsOfCord + 2 * kMostTubes) <=
              BackgroundAnatomy::kMostTriangles);
constexpr float kReach_m = 0.03f;  // Of the decoration's field.

Vec3f AnyAcross(const Vec3f& v) {
  return v.cross(std::abs(v.x()) < 0.7f ? Vec3f::UnitX() : Vec3f::UnitY()).normalized();
}

}  // namespace

/// The standard fixes the sequence of std::mt19937 but not those of its distributions.
class BackgroundAnatomy::Draws {
 public:
  explicit Draws(std::uint32_t seed) : engine_(seed) {}
  /// In [low, high).
  float operator()(float low, float high) { return low + (high - low) * static_cast<float>(engine_() >> 8) * 0x1p-24f; }

 private:
  std::mt19937 engine_;
};

BackgroundAnatomy::BackgroundAnatomy(const SceneView& scene, std::uint32_t seed)
    : space_(scene),
      scope_tip_(scene.render.scope_tip_W),
      sight_((scene.render.scope_target_W - scene.render.scope_tip_W).normalized()),
      decoration_(space_.MakeField(kReach_m)) {
  const float aspect = static_cast<float>(scene.render.width) / static_cast<float>(scene.render.height);
  field_cosine_ = std::cos(std::min(1.2f, 0.5f * std::sqrt(aspect) * RadiansOf(scene.render.fov_deg) + 0.1f));
  across_ = sight_.cross(space_.up());
  across_ = across_.norm() > 0.1f ? across_.normalized() : AnyAcross(sight_);
  Draws draws(3 + 101 * seed);
  AddLoops(&draws);
  for (Vertex& vertex : vertices_) {
    const float walls = space_.ToWalls(vertex.p_W + 0.008f * vertex.normal) / 0.008f;
    vertex.openness = Openness(vertex.p_W, vertex.normal) * (0.45f + 0.55f * std::clamp(walls, 0.0f, 1.0f));
  }
}

float BackgroundAnatomy::Openness(const Vec3f& p, const Vec3f& normal) const {
  constexpr std::array kHeights_m{0.005f, 0.012f, 0.022f};
  constexpr std::array kShares{0.40f, 0.30f, 0.20f};
  float open = 1;
  for (std::size_t k = 0; k < kHeights_m.size(); ++k) {
    const float free = decoration_.At(p + kHeights_m[k] * normal, kReach_m) / kHeights_m[k];
    open -= kShares[k] * (1 - std::clamp(free, 0.0f, 1.0f));
  }
  return open;
}

bool BackgroundAnatomy::Fits(const Vec3f& p, float radius, float pressed) const {
  return space_.Room(p) >= radius && decoration_.At(p, 0) >= radius - pressed;
}

/// True if a wall or a loop is beneath.
bool BackgroundAnatomy::Lies(const Vec3f& p, float radius) const {
  const Vec3f beneath = p - kMostDrop_m * space_.up();
  return std::min(space_.ToWalls(beneath), decoration_.At(beneath, 0)) < radius;
}

/// Bowel lies low and far from the scope; beside the field of view it is of no use [m].
float BackgroundAnatomy::Cost(const Vec3f& p) const {
  const Vec3f way = p - scope_tip_;
  const float far = way.norm();
  const float beside = std::max(0.0f, field_cosine_ - way.dot(sight_) / far);
  return space_.up().dot(p - space_.cavity().centre) - 0.5f * far + 1.2f * beside;
}

void BackgroundAnatomy::AddLoops(Draws* draws) {
  struct Start {
    float cost;
    Vec3f p_W;
  };
  std::vector<Start> starts;
  for (std::size_t node = 0; node < decoration_.size(); ++node) {
    const Vec3f p = decoration_.NodeAt(node);
    if (space_.Room(p) < kThinnest_m || !Lies(p, kThinnest_m)) continue;
    starts.push_back({Cost(p) + (*draws)(0, 0.02f), p});
  }
  std::stable_sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.cost < b.cost; });
  std::size_t rings = 0;
  std::vector<Vec3f> ends, failed;
  for (const Start& start : starts) {
    const auto is_near = [&](const Vec3f& p) { return (p - start.p_W).squaredNorm() < kThinnest_m * kThinnest_m; };
    if (std::any_of(failed.begin(), failed.end(), is_near)) continue;
    const float radius = std::min((*draws)(kThinnest_m, kThickest_m), space_.Room(start.p_W));
    if (!Fits(start.p_W, radius, kPressed_m) || !space_.Seen(start.p_W)) continue;
    std::vector<Ring> loop = Grow(start.p_W, radius, false, draws);
    if (loop.size() < kFewestRings) {
      failed.push_back(start.p_W);
      continue;
    }
    for (const Ring& ring : loop) decoration_.Lower(ring.p_W, ring.radius + kReach_m, ring.radius);
    rings += loop.size();
    for (const Ring& end : {loop.front(), loop.back()}) ends.push_back(end.p_W);
    AddTube(std::move(loop), false, draws);
    if (rings >= kMostRingsOfAll) break;
  }
  AddFat(ends, draws);
}

/// A centre line from `start` on. Each step takes the direction that fits, keeps the course, leads down and away and
/// stays next to walls and loops.
std::vector<BackgroundAnatomy::Ring> BackgroundAnatomy::Grow(const Vec3f& start, float radius, bool fat, Draws* draws) {
  const float pressed = fat ? kFatPressed * radius : kPressed_m;
  const std::size_t most_rings = fat ? kMostRingsOfCord : kMostRings;
  constexpr int kAround = 8;
  std::vector<Ring> loop{{start, radius}};
  Vec3f heading = (*draws)(0, 1) < 0.5f ? across_ : Vec3f(-across_);
  heading = (heading + (*draws)(-0.5f, 0.5f) * sight_).normalized();
  float bend = 0;
  while (loop.size() < most_rings) {
    const Vec3f& head = loop.back().p_W;
    bend = 0.9f * bend + (*draws)(-0.15f, 0.15f);
    const Vec3f right = AnyAcross(heading), above = heading.cross(right);
    const Vec3f wanted = (heading + bend * heading.cross(space_.up())).normalized();
    const float here = Cost(head);
    float best = 1e9f;
    Vec3f next = heading;
    for (const float angle : {0.0f, 0.13f, 0.28f, 0.5f}) {
      if (angle > 0.4f && best < 1e9f) break;  // Folds sharply only where it cannot go on otherwise.
      for (int k = 0; k < (angle > 0 ? kAround : 1); ++k) {
        const float turn = 2 * kPi * static_cast<float>(k) / kAround;
        const Vec3f to =
            std::cos(angle) * heading + std::sin(angle) * (std::cos(turn) * right + std::sin(turn) * above);
        const Vec3f p = head + kStep_m * to;
        if (!Fits(p, radius, pressed) || !Lies(p, radius)) continue;
        const bool own = std::any_of(loop.begin(), loop.end(), [&](const Ring& ring) {
          const auto apart = static_cast<float>(&loop.back() - &ring + 1) * kStep_m;
          return apart > 3.2f * radius && (ring.p_W - p).squaredNorm() < 3.6f * radius * radius;
        });
        if (own || !space_.Seen(p)) continue;
        const float gap = std::min(space_.ToWalls(p), decoration_.At(p, 0)) - radius;
        if (fat && decoration_.At(p, 0) > radius) continue;  // Fat hangs on a loop.
        const float cost =
            0.5f * (Cost(p) - here) / kStep_m + 0.5f * std::clamp(gap / 0.01f, 0.0f, 1.0f) - 2.0f * to.dot(wanted);
        if (cost < best) {
          best = cost;
          next = to;
        }
      }
    }
    if (best == 1e9f) break;
    heading = next;
    loop.push_back({head + kStep_m * next, radius});
  }
  return loop;
}

void BackgroundAnatomy::AddTube(std::vector<Ring> rings, bool fat, Draws* draws) {
  // Steps of a few directions are visible as kinks.
  for (int pass = 0; pass < 3; ++pass) {
    std::vector<Ring> before = rings;
    for (std::size_t k = 1; k + 1 < rings.size(); ++k) {
      rings[k].p_W = 0.5f * before[k].p_W + 0.25f * (before[k - 1].p_W + before[k + 1].p_W);
    }
  }
  // One more ring for each round end.
  const auto between = [](const Ring& end, const Ring& next) {
    return Ring{end.p_W + 0.3f * (next.p_W - end.p_W), end.radius};
  };
  rings.insert(rings.begin() + 1, between(rings[0], rings[1]));
  rings.insert(rings.end() - 1, between(rings.back(), rings[rings.size() - 2]));
  std::vector<float> lengths{0};
  for (std::size_t k = 1; k < rings.size(); ++k) {
    lengths.push_back(lengths.back() + (rings[k].p_W - rings[k - 1].p_W).norm());
  }
  const float period = (*draws)(0.020f, 0.030f), phase = (*draws)(0, 1), depth = (*draws)(0.06f, 0.16f);
  const float shade = (*draws)(-1, 1);
  const Vec2f offset{(*draws)(0, 1), (*draws)(0, 1)};  // Braces: drawn in this order.
  const auto first = static_cast<Index>(vertices_.size());
  const auto count = static_cast<int>(rings.size());
  Vec3f side = scope_tip_ - rings.front().p_W;
  for (int k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Vec3f tangent = (rings[std::min(i + 1, rings.size() - 1)].p_W - rings[i ? i - 1 : 0].p_W).normalized();
    side = (side - side.dot(tangent) * tangent).normalized();
    const Vec3f other = tangent.cross(side);
    const float along = lengths[i];
    const float end = std::min(along, lengths.back() - along) / rings[i].radius;
    const float round = end >= 1 ? 1 : std::sqrt(1 - (1 - end) * (1 - end));
    const float most = std::min(rings[i].radius, space_.Room(rings[i].p_W));
    for (int s = 0; s <= kSides; ++s) {
      const float angle = 2 * kPi * (static_cast<float>(s % kSides) / kSides - 0.5f);  // The seam is at the back.
      const float turn = 2 * kPi * (along / period + phase);
      // Bowel is drawn in all around, fat is irregular.
      const float wave = 0.5f + 0.5f * std::cos(turn + 0.8f * std::sin(angle + 9 * shade));
      const float drawn_in = fat ? 0.11f * (1 + std::sin(2 * angle + 0.7f * turn) * std::cos(0.6f * turn)) +
                                       0.07f * (1 + std::sin(3 * angle - 0.9f * turn))
                                 : depth * wave * wave * wave;
      const float radius = most * round * (1 - drawn_in);
      const Vec3f out = std::cos(angle) * side + std::sin(angle) * other;
      const Vec2f place(offset.x() + most * (2 * kPi * static_cast<float>(s) / kSides - kPi), offset.y() + along);
      vertices_.push_back({rings[i].p_W + radius * out, out, place, 1, fat ? 1.0f : 0.0f, shade});
    }
  }
  const auto at = [&](int ring, int s) { return first + static_cast<Index>(ring * (kSides + 1) + s); };
  for (int k = 0; k < count; ++k) {
    for (int s = 0; s <= kSides; ++s) {
      const Vec3f around = vertices_[at(k, s % kSides + 1)].p_W - vertices_[at(k, (s + kSides - 1) % kSides)].p_W;
      const Vec3f on = k == 0 || k == count - 1
                           ? Vec3f(rings[std::min<std::size_t>(k + 1, rings.size() - 1)].p_W - rings[k ? k - 1 : 0].p_W)
                           : Vec3f(vertices_[at(k + 1, s)].p_W - vertices_[at(k - 1, s)].p_W);
      const bool last = k == 0 || k == count - 1;  // A point.
      vertices_[at(k, s)].normal = last ? Vec3f((k ? 1.0f : -1.0f) * on.normalized()) : around.cross(on).normalized();
    }
  }
  for (int k = 0; k + 1 < count; ++k) {
    for (int s = 0; s < kSides; ++s) {
      triangles_.push_back({at(k, s), at(k, s + 1), at(k + 1, s + 1)});
      triangles_.push_back({at(k, s), at(k + 1, s + 1), at(k + 1, s)});
    }
  }
}

/// Cords of fat over the ends of the loops and in the clefts between them.
void BackgroundAnatomy::AddFat(const std::vector<Vec3f>& ends, Draws* draws) {
  std::size_t rings = 0;
  const auto add = [&](const Vec3f& start, float radius) {
    if (rings >= kMostRingsOfFat || !Fits(start, radius, kFatPressed * radius)) return;
    std::vector<Ring> cord = Grow(start, radius, true, draws);
    if (cord.size() < kFewestRingsOfCord) return;
    for (const Ring& ring : cord) decoration_.Lower(ring.p_W, ring.radius + kReach_m, 0.7f * ring.radius);
    rings += cord.size();
    AddTube(std::move(cord), true, draws);
  };
  for (const Vec3f& end : ends) {
    for (int attempt = 0; attempt < 4; ++attempt) {
      const Vec3f way{(*draws)(-1, 1), (*draws)(-1, 1), (*draws)(-1, 1)};  // Braces: drawn in this order.
      add(end + 0.013f * way.normalized(), (*draws)(0.009f, 0.012f));
    }
  }
  std::vector<Vec3f> clefts;
  for (std::size_t node = 0; node < decoration_.size(); ++node) {
    if (decoration_[node] > kThinnestCord_m || decoration_[node] < 0.004f) continue;
    const Vec3f p = decoration_.NodeAt(node);
    if (space_.Room(p) > kThinnestCord_m && space_.Seen(p)) clefts.push_back(p);
  }
  while (!clefts.empty() && rings < kMostRingsOfFat) {
    const auto pick = static_cast<std::size_t>((*draws)(0, static_cast<float>(clefts.size())));
    const Vec3f start = clefts[std::min(pick, clefts.size() - 1)];
    add(start, std::min((*draws)(kThinnestCord_m, 0.011f), space_.Room(start)));
    std::erase_if(clefts, [&](const Vec3f& p) { return (p - start).norm() < 0.012f; });
  }
}

}  // namespace fulcrum::render
