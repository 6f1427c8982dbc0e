#include "render_node/geometry/cut_strands.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace fulcrum::render {
namespace {

constexpr float kAnchor_m = kCurl_m;       // From the contour into the tissue: beneath the lip.
constexpr float kSearchStep_m = 0.00005f;  // Half a texel, along a strand to the contour.
constexpr float kWidestHalf_m = 0.0025f;   // From the middle of the slit to the contour.
constexpr float kSlitAside_m = 0.0012f;    // From the middle of the severed edges to the slit.
constexpr float kStrandTilt_rad = 0.7f;    // Largest angle to the shortest way across.
constexpr float kFewerBurnt = 0.85f;       // Share that is missing where the lips are charred.
constexpr float kThinnestStrand_m = 0.00003f, kThickestStrand_m = 0.00016f;
constexpr std::size_t kStrandPoints = 8;  // Of a strand; broken, half of them for each end.
constexpr float kMostSag = 0.45f;         // Of its length.
constexpr float kLeastOpacity = 0.30f;

/// SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t MixedBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// 0 … 1, the n-th number of a hash.
float UniformOf(std::uint64_t hash, std::uint64_t n) {
  return static_cast<float>(MixedBits(hash ^ (n * 0xd1342543de82ef95ull)) >> 40) / 16777216.0f;
}

float DamageAt(const Atlas& atlas, const Vec2f& material) {
  const auto texel = atlas.At(material);
  return texel ? std::max(static_cast<float>((*texel)[1]) / 255, static_cast<float>((*texel)[2]) / 128) : 0;
}

/// The nearest removed place on a line through `middle`; none within kSlitAside_m. A slit lies up to half a cell beside
/// the middle of the edges that it has severed.
std::optional<Vec2f> RemovedNear(const Atlas& atlas, const Vec2f& middle, const Vec2f& direction) {
  for (float aside = 0; aside < kSlitAside_m; aside += kSearchStep_m) {
    for (const float sign : {1.0f, -1.0f}) {
      const Vec2f at = middle + sign * aside * direction;
      if (atlas.Removed(at)) return at;
    }
  }
  return std::nullopt;
}

/// The contour from `from` on in a direction; none within kWidestHalf_m.
std::optional<Vec2f> ContourFrom(const Atlas& atlas, const Vec2f& from, const Vec2f& direction) {
  for (float along = 0; along < kWidestHalf_m; along += kSearchStep_m) {
    const Vec2f at = from + along * direction;
    if (!atlas.Removed(at)) return at;
  }
  return std::nullopt;
}

/// A strand's points with a ribbon's half width around them, to the eye. It looks as the tissue does where it begins:
/// between its anchors none is left.
void AppendStrand(std::span<const Vec3f> points, std::span<const float> half_m, const Vec2f& material,
                  const Vec3f& eye_W, float pixels_per_rad, CutGeometry* out) {
  const auto first = static_cast<Index>(out->positions.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vec3f along = points[std::min(k + 1, points.size() - 1)] - points[k > 0 ? k - 1 : 0];
    const Vec3f to_eye = eye_W - points[k];
    const float distance = to_eye.norm();
    const Vec3f facing = to_eye / distance;
    const Vec3f across = along.cross(facing);
    const Vec3f side = across.squaredNorm() > 1e-16f ? across.normalized() : facing.unitOrthogonal();
    const float least = 0.5f * distance / pixels_per_rad, half = std::max(half_m[k], least);
    const float opacity = 0.8f * std::max(kLeastOpacity, half_m[k] / half);
    for (const float sign : {-1.0f, 1.0f}) {
      // Round in the light.
      out->Add(points[k] + sign * half * side, (facing + 0.8f * sign * side).normalized(), material,
               CutGeometry::kStrand, opacity);
    }
    if (k == 0) continue;
    const Index b = first + static_cast<Index>(2 * k);
    out->triangles.push_back({b - 2, b - 1, b});
    out->triangles.push_back({b, b - 1, b + 1});
  }
}

}  // namespace

void CutStrands::Find(const Atlas& atlas, const MembraneMesh& mesh, const SheetPlaces& places) {
  strands_.clear();
  if (atlas.removals() == 0) return;
  for (const auto& cut : places.cut_triangles()) {
    for (std::size_t part = 0; part < cut.parts; ++part) {
      FindAt(cut.triangle, cut.first_vertex + static_cast<Index>(3 * part), atlas, mesh, places);
    }
  }
}

void CutStrands::FindAt(Index triangle, Index first_vertex, const Atlas& atlas, const MembraneMesh& mesh,
                        const SheetPlaces& places) {
  // The border of the part: between the middles of the edges from its own corners to its ghosts.
  std::array<Vec2f, 3> corner;
  std::array<bool, 3> own{};
  Vec2f owned = Vec2f::Zero(), ghosts = Vec2f::Zero();
  for (Index k = 0; k < 3; ++k) {
    corner[k] = mesh.materials()[first_vertex + k];
    own[k] = mesh.sides()[first_vertex + k] > 0;
    (own[k] ? owned : ghosts) += corner[k];
  }
  const auto count_own = static_cast<float>(own[0] + own[1] + own[2]);
  std::array<Vec2f, 2> end;
  std::size_t ends = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    if (own[k] != own[next] && ends < 2) end[ends++] = 0.5f * (corner[k] + corner[next]);
  }
  if (ends < 2) return;
  const Vec2f across = (ghosts / (3 - count_own) - owned / count_own).normalized();
  // Both sides of the slit have strands.
  const float wanted = 0.5f * kStrandsPerMetre * (end[1] - end[0]).norm();
  const std::uint64_t site = MixedBits(8 * std::uint64_t{triangle} + 4 * own[2] + 2 * own[1] + own[0]);
  const auto count = static_cast<std::uint64_t>(wanted + UniformOf(site, 0));
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::uint64_t hash = MixedBits(site + k + 1);
    const Vec2f middle = end[0] + UniformOf(hash, 1) * (end[1] - end[0]);
    const float tilt = kStrandTilt_rad * (2 * UniformOf(hash, 2) - 1);
    const Vec2f direction(std::cos(tilt) * across.x() - std::sin(tilt) * across.y(),
                          std::sin(tilt) * across.x() + std::cos(tilt) * across.y());
    const auto slit = RemovedNear(atlas, middle, direction);
    if (!slit) continue;  // Severed, but nothing has opened.
    const auto lip_a = ContourFrom(atlas, *slit, -direction), lip_b = ContourFrom(atlas, *slit, direction);
    if (!lip_a || !lip_b) continue;
    Strand strand;
    strand.material_a = *lip_a - kAnchor_m * direction;
    strand.material_b = *lip_b + kAnchor_m * direction;
    if (atlas.Removed(strand.material_a) || atlas.Removed(strand.material_b)) continue;
    const float burnt = 0.5f * (DamageAt(atlas, strand.material_a) + DamageAt(atlas, strand.material_b));
    if (UniformOf(hash, 3) < kFewerBurnt * std::clamp(2 * burnt, 0.0f, 1.0f)) continue;
    const auto a = places.Find(mesh, strand.material_a), b = places.Find(mesh, strand.material_b);
    if (!a || !b) continue;
    strand.a = *a;
    strand.b = *b;
    strand.length_m = (strand.material_b - strand.material_a).norm() * (1.0f + 0.4f * UniformOf(hash, 4));
    strand.breaks_at = kWeakestStrand + (kStrongestStrand - kWeakestStrand) * UniformOf(hash, 5);
    const float u = UniformOf(hash, 6);
    strand.thickness_m = kThinnestStrand_m + (kThickestStrand_m - kThinnestStrand_m) * u * u * u;
    strand.sag_m = 0.5f * thickness_[mesh.NodeOf(a->vertices[0]) / scene_.membrane.cols];
    strand.hash = hash;
    strands_.push_back(strand);
  }
}

void CutStrands::Append(const MembraneMesh& mesh, const Vec3f& eye_W, float pixels_per_rad, CutGeometry* out) const {
  for (const Strand& strand : strands_) {
    const Vec3f normal_a = strand.a.Of(mesh.normals()).normalized(),
                normal_b = strand.b.Of(mesh.normals()).normalized();
    const Vec3f a = strand.a.Of(mesh.positions()) - strand.sag_m * normal_a;
    const Vec3f b = strand.b.Of(mesh.positions()) - strand.sag_m * normal_b;
    const float gap = (b - a).norm(), stretch = StretchOf(strand, mesh);
    // Not finite, absurdly far or so near that it has no direction: not drawn.
    if (!(gap > 1e-5f && gap < 0.1f && normal_a.allFinite() && normal_b.allFinite())) continue;
    const Vec3f along = (b - a) / gap;
    Vec3f down = -(normal_a + normal_b);
    down -= down.dot(along) * along;
    down = down.squaredNorm() > 1e-6f ? down.normalized() : along.unitOrthogonal();
    const Vec3f aside = along.cross(down);
    const float lean = 2 * UniformOf(strand.hash, 7) - 1;
    std::array<Vec3f, kStrandPoints> points;
    std::array<float, kStrandPoints> half;
    if (stretch <= strand.breaks_at && gap <= kLongestSpan_m) {
      // A shallow arc of length L over a chord d sags by sqrt(3 / 8 d (L - d)).
      const float slack = std::max(0.0f, strand.length_m - gap);
      const float sag = std::min(std::sqrt(0.375f * gap * slack), kMostSag * strand.length_m);
      const Vec3f bow = sag * (down + 0.8f * lean * aside).normalized();
      const float thin = 1 / std::sqrt(std::max(1.0f, stretch));  // Its volume does not change.
      for (std::size_t k = 0; k < kStrandPoints; ++k) {
        const float u = static_cast<float>(k) / (kStrandPoints - 1);
        points[k] = a + u * (b - a) + 4 * u * (1 - u) * bow;
        // It spreads where it is anchored.
        const float spread = 1 + 1.6f * std::exp(-9 * std::min(u, 1 - u));
        half[k] = 0.5f * strand.thickness_m * thin * spread;
      }
      AppendStrand(points, half, strand.material_a, eye_W, pixels_per_rad, out);
      continue;
    }
    // Each end curls back, the shorter the farther the lips are apart.
    const float beyond = std::max(0.0f, stretch / strand.breaks_at - 1);
    const float length = strand.length_m * (0.14f + 0.18f * UniformOf(strand.hash, 8)) / (1 + 0.8f * beyond);
    const float turn = (1.2f + 1.8f * UniformOf(strand.hash, 9)) * std::min(1.0f, 0.5f + beyond);
    constexpr std::size_t kHalf = kStrandPoints / 2;
    for (const float sign : {1.0f, -1.0f}) {
      const Vec3f start = sign > 0 ? a : b;
      const Vec3f out_of = sign * along, bend = (down + lean * aside).normalized();
      Vec3f at = start;
      for (std::size_t k = 0; k < kHalf; ++k) {
        const float u = static_cast<float>(k) / (kHalf - 1), angle = turn * (u - 0.5f / (kHalf - 1));
        if (k > 0) at += length / (kHalf - 1) * (std::cos(angle) * out_of + std::sin(angle) * bend);
        points[k] = at;
        half[k] = 0.5f * strand.thickness_m * (1.3f - 0.9f * u);
      }
      AppendStrand(std::span(points).first(kHalf), std::span(half).first(kHalf),
                   sign > 0 ? strand.material_a : strand.material_b, eye_W, pixels_per_rad, out);
    }
  }
}

}  // namespace fulcrum::render
