#include "render_node/geometry/cut_lip.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace fulcrum::render {
namespace {

constexpr float kSectionSpacing_m = 0.00040f;  // Of the sections along a contour.
constexpr float kWidth_m = kCurl_m + kLipFlat_m;
constexpr float kBeside_m = 0.00015f;  // Of the place that decides which side of a slit a point of the contour is on.
constexpr std::size_t kArc = 4;        // Pieces of the curl.
constexpr std::size_t kRows = kArc + 2;
constexpr std::size_t kVertices = 2 * kRows + 3;  // Of a section: both surfaces and the wall.
// The curl of an unburnt lip, what damage adds, and what varies along the lip [rad].
constexpr float kLeast_rad = 0.25f, kByDamage_rad = 1.3f, kVaried_rad = 1.0f;
constexpr int kFramePasses = 12;         // A standard deviation of 1 mm along the lip.
constexpr float kVariation_m = 0.0016f;  // Length over which it varies.
// Search for the next cut: from where no step of this contour's own texels is taken for one.
constexpr float kFreeFrom_m = 0.0005f, kFreeStep_m = 0.0001f;
// Texels that are removed have no colour of tissue: that of the wall is taken from this far beside them.
constexpr float kInTissue_m = 0.00025f;

float EaseBetween(float low, float high, float value) {
  const float u = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return u * u * (3 - 2 * u);
}

/// 0 … 1, the same for a corner of a lattice in every run.
float AtCorner(int x, int y) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^ static_cast<std::uint32_t>(y) * 0xd8163841u;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return static_cast<float>((h ^ (h >> 15)) >> 8) / 16777216.0f;
}

/// Continuous, 0 … 1, a function of the place on the sheet alone: it stays where it is while the cut goes on.
float Variation(const Vec2f& material) {
  const Vec2f place = material / kVariation_m;
  const auto x = static_cast<int>(std::floor(place.x())), y = static_cast<int>(std::floor(place.y()));
  const float u = EaseBetween(0, 1, place.x() - std::floor(place.x()));
  const float v = EaseBetween(0, 1, place.y() - std::floor(place.y()));
  return (1 - v) * ((1 - u) * AtCorner(x, y) + u * AtCorner(x + 1, y)) +
         v * ((1 - u) * AtCorner(x, y + 1) + u * AtCorner(x + 1, y + 1));
}

}  // namespace

void CutLip::Find(const Atlas& atlas, const MembraneMesh& mesh, const SheetPlaces& places) {
  stations_.clear();
  if (atlas.removals() == 0) return;
  for (const Contour& contour : FindContours(atlas, kSectionSpacing_m)) {
    const std::size_t first = stations_.size();
    for (const ContourPoint& point : contour.points) {
      Station& station = stations_.emplace_back();
      station.at = point;
      station.next = stations_.size();
      const auto beside = places.Find(mesh, point.material + kBeside_m * point.inward);
      if (!beside) continue;
      station.drawn = true;
      station.edge = places.Continued(mesh, *beside, point.material);
      float free = kFreeFrom_m;
      while (free < 2 * kWidth_m && !atlas.Removed(point.material + free * point.inward)) free += kFreeStep_m;
      station.width_m = std::min(kWidth_m, 0.5f * free);
      const Vec2f inner = point.material + station.width_m * point.inward;
      const auto found = places.Find(mesh, inner);
      station.inner = found ? *found : places.Continued(mesh, *beside, inner);
      station.thickness_m = thickness_[mesh.NodeOf(beside->vertices[0]) / cols_];
    }
    if (stations_.size() > first) stations_.back().next = contour.closed ? first : stations_.size() - 1;
  }
  Curl(atlas);
}

bool CutLip::Curl(const Atlas& atlas) {
  bool changed = false;
  for (Station& station : stations_) {
    const float before = station.curl_rad;
    float damage = 0;
    for (const float depth_m : {0.0002f, 0.0004f, 0.0006f}) {
      const auto texel = atlas.At(station.at.material + depth_m * station.at.inward);
      // Collagen shrinks by its damage; what is dry has shrunk all it can.
      if (texel) damage += std::max(static_cast<float>((*texel)[1]) / 255, static_cast<float>((*texel)[2]) / 128) / 3;
    }
    station.curl_rad = std::max(0.15f, kLeast_rad + kByDamage_rad * EaseBetween(0.05f, 0.8f, damage) +
                                           kVaried_rad * (Variation(station.at.material) - 0.5f));
    changed = changed || station.curl_rad != before;
  }
  return changed;
}

void CutLip::Place(const MembraneMesh& mesh) {
  sections_.resize(stations_.size());
  for (std::size_t k = 0; k < stations_.size(); ++k) {
    const Station& station = stations_[k];
    Section& section = sections_[k];
    section.valid = false;
    if (!station.drawn) continue;
    const Triangle& t = station.edge.vertices;
    Eigen::Matrix2f material;
    Eigen::Matrix<float, 3, 2> place;
    for (int side = 0; side < 2; ++side) {
      const Index corner = t[static_cast<std::size_t>(side) + 1];
      material.col(side) = mesh.materials()[corner] - mesh.materials()[t[0]];
      place.col(side) = mesh.positions()[corner] - mesh.positions()[t[0]];
    }
    section.frame = place * material.inverse();
    section.inner = station.inner.Of(mesh.positions());
    section.material = station.at.material + station.width_m * station.at.inward;
    // Of the part of the sheet that the contour belongs to; not finite: not valid.
    const float apart = (station.edge.Of(mesh.positions()) - section.inner).norm();
    section.valid = apart < kMostStretch * station.width_m && section.frame.squaredNorm() < kMostStretch * kMostStretch;
  }
  // Parts of neighbouring triangles continue the sheet each in its own plane, but a lip is one piece: what it continues
  // is their mean. Not of the positions, which would close the ends of the slit: of what each continues to.
  Smooth(kFramePasses,
         [](const Section& a, const Section& c, Section* b) { b->frame = 0.25f * (a.frame + 2 * b->frame + c.frame); });
  Smooth(2, [](const Section& a, const Section& c, Section* b) {
    const auto continued = [b](const Section& from) { return from.inner + b->frame * (b->material - from.material); };
    b->inner = 0.25f * (continued(a) + 2 * b->inner + continued(c));
  });
  for (std::size_t k = 0; k < stations_.size(); ++k) {
    Section& section = sections_[k];
    section.edge = section.inner - section.frame * (stations_[k].width_m * stations_[k].at.inward);
    section.valid = section.valid && (section.edge - section.inner).norm() > 0.1f * stations_[k].width_m;
  }
}

/// average(a, c, &b) for each section b between two others.
template <class Average>
void CutLip::Smooth(int passes, const Average& average) {
  for (int pass = 0; pass < passes; ++pass) {
    before_ = sections_;
    for (std::size_t k = 0; k < stations_.size(); ++k) {
      const std::size_t next = stations_[k].next, after = stations_[next].next;
      if (next == k || after == next || after == k) continue;
      const Section &a = before_[k], &c = before_[after];
      if (a.valid && before_[next].valid && c.valid) average(a, c, &sections_[next]);
    }
  }
}

void CutLip::AppendSection(const Station& station, const Section& section, const Vec3f& normal,
                           CutGeometry* out) const {
  const Vec3f across = section.edge - section.inner;
  const float width = across.norm();
  const Vec3f o = across / width;
  Vec3f n = normal - normal.dot(o) * o;
  n = n.squaredNorm() > 1e-6f ? n.normalized() : o.unitOrthogonal();
  const float share_of_flat = kLipFlat_m / kWidth_m;
  const float flat = width * share_of_flat, curl = std::min(width - flat, kCurl_m);
  const float half = 0.5f * station.thickness_m, radius = curl / station.curl_rad;
  std::array<Vec3f, kRows> centre, up;
  for (std::size_t row = 0; row < kRows; ++row) {
    const float share = row == 0 ? 0 : static_cast<float>(row - 1) / kArc, a = share * station.curl_rad;
    centre[row] = section.inner + (row == 0 ? 0 : flat + radius * std::sin(a)) * o + radius * (1 - std::cos(a)) * n;
    up[row] = std::cos(a) * n - std::sin(a) * o;
  }
  const auto material = [&](std::size_t row) {
    const float share = row == 0 ? 1.0f : (1 - share_of_flat) * (1 - static_cast<float>(row - 1) / kArc);
    return Vec2f(station.at.material + std::max(kInTissue_m, share * station.width_m) * station.at.inward);
  };
  const auto opacity = [](std::size_t row) { return row == 0 ? 0.0f : 1.0f; };
  // Flush with the sheet where the lip begins.
  const auto lift = [half](std::size_t row) { return row == 0 ? 0.2f * half : half; };
  for (std::size_t row = 0; row < kRows; ++row) {
    out->Add(centre[row] + lift(row) * up[row], up[row], material(row), CutGeometry::kUpper, opacity(row));
  }
  const Vec3f end = std::sin(station.curl_rad) * n + std::cos(station.curl_rad) * o;
  const Vec3f &middle = centre[kRows - 1], &top = up[kRows - 1];
  out->Add(middle + half * top, (top + end).normalized(), material(kRows - 1), CutGeometry::kWall, 1);
  out->Add(middle + 0.6f * half * end, end, material(kRows - 1), CutGeometry::kWall, 1);
  out->Add(middle - half * top, (end - top).normalized(), material(kRows - 1), CutGeometry::kWall, 1);
  for (std::size_t row = kRows; row-- > 0;) {
    out->Add(centre[row] - lift(row) * up[row], -up[row], material(row), CutGeometry::kUnderside, opacity(row));
  }
}

void CutLip::Append(const MembraneMesh& mesh, CutGeometry* out) {
  Place(mesh);
  const auto start = static_cast<Index>(out->positions.size());
  Index drawn = 0;
  std::vector<Index> vertex(stations_.size(), kNoIndex);
  for (std::size_t k = 0; k < stations_.size(); ++k) {
    if (!sections_[k].valid) continue;
    AppendSection(stations_[k], sections_[k], stations_[k].inner.Of(mesh.normals()), out);
    vertex[k] = start + static_cast<Index>(kVertices) * drawn++;
  }
  for (std::size_t k = 0; k < stations_.size(); ++k) {
    const std::size_t next = stations_[k].next;
    if (next == k || vertex[k] == kNoIndex || vertex[next] == kNoIndex) continue;
    if ((sections_[k].edge - sections_[next].edge).norm() > kMostStretch * kSectionSpacing_m) continue;
    for (Index row = 0; row + 1 < kVertices; ++row) {
      // The wall has vertices of its own.
      if (row == kRows - 1 || row == kRows + 2) continue;
      const Index a = vertex[k] + row, b = vertex[next] + row;
      // Tissue is to the left of the way along the contour.
      out->triangles.push_back({a, a + 1, b});
      out->triangles.push_back({b, a + 1, b + 1});
    }
  }
}

}  // namespace fulcrum::render
