#include "render_node/geometry/solid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fulcrum::render {
namespace {

constexpr Colour kSteel{0.42f, 0.44f, 0.46f, 1.0f};
constexpr Colour kPolishedSteel{0.60f, 0.61f, 0.63f, 1.0f};
constexpr Colour kInsulation{0.012f, 0.012f, 0.014f, 0.25f};
constexpr Colour kTitanium{0.50f, 0.52f, 0.55f, 0.62f};  // Matt: it scatters two fifths of its light.
constexpr Colour kTube{0.26f, 0.27f, 0.29f, 1.0f};       // Brushed steel.
constexpr Colour kBore{0.006f, 0.005f, 0.005f, 0.05f};   // The dark within a tube.
constexpr Colour kCeramic{0.70f, 0.67f, 0.60f, 0.10f};

void AppendQuadFace(const std::array<Vec3f, 4>& corners, const Colour& colour, Solid* solid) {
  const Vec3f area = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
  if (area.squaredNorm() == 0) {
    return;
  }
  const Vec3f normal = area.normalized();
  const auto first = static_cast<Index>(solid->positions.size());
  for (const Vec3f& corner : corners) {
    solid->positions.push_back(corner);
    solid->normals.push_back(normal);
    solid->colours.push_back(colour);
  }
  solid->triangles.push_back({first, first + 1, first + 2});
  solid->triangles.push_back({first, first + 2, first + 3});
}

void AppendCap(std::span<const Vec3f> outline, const Vec3f& normal, const Colour& colour, Solid* solid) {
  const auto first = static_cast<Index>(solid->positions.size());
  for (const Vec3f& corner : outline) {
    solid->positions.push_back(corner);
    solid->normals.push_back(normal);
    solid->colours.push_back(colour);
  }
  for (Index k = 1; k + 1 < outline.size(); ++k) {
    const Triangle forward{first, first + k, first + k + 1};
    const Vec3f area = (outline[k] - outline[0]).cross(outline[k + 1] - outline[0]);
    solid->triangles.push_back(area.dot(normal) >= 0 ? forward : Triangle{forward[0], forward[2], forward[1]});
  }
}

/// A wire with flat sides and bevelled edges along a path in the plane y = 0, shaded smoothly along it.
/// @param halves half of its width at each point of the path.
void AppendWire(std::span<const Vec3f> path, std::span<const float> halves, const Colour& colour, Solid* solid) {
  constexpr float kFlat = 0.55f;  // Of a side between its bevels.
  constexpr std::array<std::array<float, 2>, 8> kSection{
      {{1, -kFlat}, {1, kFlat}, {kFlat, 1}, {-kFlat, 1}, {-1, kFlat}, {-1, -kFlat}, {-kFlat, -1}, {kFlat, -1}}};
  std::vector<Vec3f> first_outline, last_outline;
  for (std::size_t s = 0; s < kSection.size(); ++s) {
    const auto &a = kSection[s], &b = kSection[(s + 1) % kSection.size()];
    const auto first = static_cast<Index>(solid->positions.size());
    for (std::size_t k = 0; k < path.size(); ++k) {
      const Vec3f along = path[std::min(k + 1, path.size() - 1)] - path[k > 0 ? k - 1 : 0];
      const Vec3f across = Vec3f(along.z(), 0, -along.x()).normalized();
      const auto corner = [&](const std::array<float, 2>& c) {
        return Vec3f(path[k] + halves[k] * (c[0] * across + c[1] * Vec3f::UnitY()));
      };
      const Vec3f normal = ((a[0] + b[0]) * across + (a[1] + b[1]) * Vec3f::UnitY()).normalized();
      for (const auto& c : {a, b}) {
        solid->positions.push_back(corner(c));
        solid->normals.push_back(normal);
        solid->colours.push_back(colour);
      }
      if (k == 0) first_outline.push_back(corner(a));
      if (k + 1 == path.size()) last_outline.push_back(corner(a));
      if (k == 0) continue;
      const Index at = first + 2 * static_cast<Index>(k);
      solid->triangles.push_back({at - 2, at - 1, at + 1});
      solid->triangles.push_back({at - 2, at + 1, at});
    }
  }
  AppendCap(first_outline, (path[0] - path[1]).normalized(), colour, solid);
  AppendCap(last_outline, (path.back() - path[path.size() - 2]).normalized(), colour, solid);
}

void AppendStraightTube(float z0, float z1, float r0, float r1, int segments, const Colour& colour, Solid* solid) {
  const std::array<Vec3f, 2> path{Vec3f(0, 0, z0), Vec3f(0, 0, z1)};
  const std::array<float, 2> radii{r0, r1};
  AppendTube(path, radii, segments, colour, solid);
}

}  // namespace

void AppendTube(std::span<const Vec3f> path, std::span<const float> radii, int segments, const Colour& colour,
                Solid* solid) {
  const auto sides = static_cast<Index>(segments);
  const auto first = static_cast<Index>(solid->positions.size());
  Vec3f across = (path[1] - path[0]).normalized().unitOrthogonal();
  std::vector<Vec3f> ring(sides);
  for (std::size_t k = 0; k < path.size(); ++k) {
    const Vec3f ahead = path[std::min(k + 1, path.size() - 1)] - path[k];
    const Vec3f behind = path[k] - path[k > 0 ? k - 1 : 0];
    const Vec3f along = (ahead.normalized() + behind.normalized()).normalized();
    // Transported along the path, so that consecutive rings are not twisted against each other.
    across = (across - across.dot(along) * along).normalized();
    const Vec3f other = along.cross(across);
    for (Index s = 0; s < sides; ++s) {
      const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(s) / static_cast<float>(sides);
      const Vec3f normal = std::cos(angle) * across + std::sin(angle) * other;
      ring[s] = path[k] + radii[k] * normal;
      solid->positions.push_back(ring[s]);
      solid->normals.push_back(normal);
      solid->colours.push_back(colour);
    }
    if (k > 0) {
      const Index base = first + static_cast<Index>(k - 1) * sides;
      for (Index s = 0; s < sides; ++s) {
        const Index a = base + s, b = base + (s + 1) % sides;
        solid->triangles.push_back({a, b, b + sides});
        solid->triangles.push_back({a, b + sides, a + sides});
      }
    }
  }
  const std::vector<Vec3f> start(solid->positions.begin() + first, solid->positions.begin() + first + sides);
  AppendCap(start, (path[0] - path[1]).normalized(), colour, solid);
  AppendCap(ring, (path.back() - path[path.size() - 2]).normalized(), colour, solid);
}

void AppendLoft(std::span<const std::vector<Vec3f>> outlines, const Colour& colour, Solid* solid) {
  for (std::size_t k = 0; k + 1 < outlines.size(); ++k) {
    const auto &a = outlines[k], &b = outlines[k + 1];
    for (std::size_t s = 0; s < a.size(); ++s) {
      const std::size_t next = (s + 1) % a.size();
      AppendQuadFace({a[s], a[next], b[next], b[s]}, colour, solid);
    }
  }
  const Vec3f along = (outlines.back()[0] - outlines.front()[0]).normalized();
  AppendCap(outlines.front(), -along, colour, solid);
  AppendCap(outlines.back(), along, colour, solid);
}

Solid GrasperShaft(const ToolShape& shape) {
  Solid solid;
  const float hinge = -shape.tip_length_m;
  AppendStraightTube(-shape.shaft_length_m, hinge - 0.008f, shape.shaft_radius_m, shape.shaft_radius_m, 24, kInsulation,
                     &solid);
  AppendStraightTube(hinge - 0.008f, hinge - 0.005f, 0.98f * shape.shaft_radius_m, 0.9f * shape.shaft_radius_m, 24,
                     kSteel, &solid);
  // The fork that carries the hinge, and its pin.
  for (const float side : {-1.0f, 1.0f}) {
    const float y0 = side * 0.85f * shape.shaft_radius_m, y1 = side * 0.5f * shape.shaft_radius_m;
    std::vector<std::vector<Vec3f>> outlines;
    for (const float z : {hinge - 0.0055f, hinge + 0.0018f}) {
      const float x = 0.55f * shape.shaft_radius_m;
      const float low = std::min(y0, y1), high = std::max(y0, y1);
      outlines.push_back({{-x, low, z}, {x, low, z}, {x, high, z}, {-x, high, z}});
    }
    AppendLoft(outlines, kSteel, &solid);
  }
  const std::array<Vec3f, 2> pin{Vec3f(0, -0.95f * shape.shaft_radius_m, hinge),
                                 Vec3f(0, 0.95f * shape.shaft_radius_m, hinge)};
  const std::array<float, 2> pin_radius{0.0008f, 0.0008f};
  AppendTube(pin, pin_radius, 12, kPolishedSteel, &solid);
  return solid;
}

Solid GrasperJaw(const ToolShape& shape) {
  Solid solid;
  const float length = shape.tip_length_m;
  const float width = 0.8f * std::min(shape.shaft_radius_m, 2 * shape.tip_radius_m);
  const float height = 0.75f * shape.tip_radius_m;
  // A half round bar that tapers towards the tip; its flat inner face carries teeth of a millimetre.
  constexpr int kTeeth = 14;
  std::vector<std::vector<Vec3f>> outlines;
  for (int k = 0; k <= 2 * kTeeth; ++k) {
    const float u = static_cast<float>(k) / (2 * kTeeth);
    const float z = -0.002f + u * (length + 0.002f);
    const float taper = 1.0f - 0.45f * u * u;
    const float rounding = u > 0.93f ? std::sqrt(std::max(0.15f, 1 - std::pow((u - 0.93f) / 0.075f, 2.0f))) : 1.0f;
    const float tooth = (k % 2 == 0 || u < 0.2f) ? 0.00005f : 0.00045f;
    const float w = width * taper * rounding, h = height * taper * rounding + 0.0004f;
    std::vector<Vec3f> outline;
    outline.emplace_back(tooth, -w, z);
    for (int s = 0; s <= 6; ++s) {
      const float angle = std::numbers::pi_v<float> * (static_cast<float>(s) / 6 - 0.5f);
      outline.emplace_back(0.0005f + h * std::cos(angle), w * std::sin(angle), z);
    }
    outline.emplace_back(tooth, w, z);
    outlines.push_back(std::move(outline));
  }
  AppendLoft(outlines, kPolishedSteel, &solid);
  return solid;
}

Solid ScissorBlade(const ToolShape& shape) {
  Solid solid;
  constexpr int kSections = 12;
  const float width = 0.7f * std::min(shape.shaft_radius_m, 2 * shape.tip_radius_m);
  const float height = 0.9f * shape.tip_radius_m;
  std::vector<std::vector<Vec3f>> outlines;
  for (int k = 0; k <= kSections; ++k) {
    const float u = static_cast<float>(k) / kSections;
    const float z = -0.002f + u * (shape.tip_length_m + 0.002f);
    const float bow = 0.35f * width * u * u;  // To the side, as of dissecting scissors.
    const float h = height * (1 - 0.85f * u) + 0.0002f, w = 0.35f * width * (1 - 0.6f * u) + 0.0001f;
    outlines.push_back({{0, bow - w, z}, {h, bow - w, z}, {0.8f * h, bow + w, z}, {0, bow + w, z}});
  }
  AppendLoft(outlines, kPolishedSteel, &solid);
  return solid;
}

Solid ClipApplierShaft(const ToolShape& shape) {
  Solid solid;
  const float hinge = -shape.tip_length_m, r = shape.shaft_radius_m;
  AppendStraightTube(-shape.shaft_length_m, hinge - 0.006f, r, r, 24, kTube, &solid);
  // The collar that closes the jaws, and the dark within it.
  const std::array<Vec3f, 4> path{Vec3f(0, 0, hinge - 0.006f), Vec3f(0, 0, hinge - 0.0055f),
                                  Vec3f(0, 0, hinge - 0.001f), Vec3f(0, 0, hinge)};
  const std::array<float, 4> radii{r, 1.02f * r, 1.02f * r, 0.8f * r};
  AppendTube(path, radii, 24, kTube, &solid);
  AppendStraightTube(hinge, hinge + 2e-5f, 0.7f * r, 0.7f * r, 24, kBore, &solid);
  return solid;
}

Solid ClipApplierJaw(const ToolShape& shape) {
  Solid solid;
  const float length = shape.tip_length_m, r = shape.tip_radius_m;
  const float groove = 0.4f * r;  // Half of its width.
  constexpr float kApart = 5e-5f;
  struct Section {
    float u, width, height, depth;  // Place along the jaw, half width, height and depth of the groove.
  };
  // A springy arm, then the jaw with parallel sides, rounded at its end. The groove is closed at both ends.
  const std::array<Section, 9> sections{{{-0.25f, 0.50f * r, 0.55f * r, 0},
                                         {0.12f, 0.50f * r, 0.55f * r, 0},
                                         {0.20f, 0.85f * r, 0.80f * r, 0},
                                         {0.24f, 0.85f * r, 0.80f * r, 0},
                                         {0.25f, 0.85f * r, 0.80f * r, 0.35f * r},
                                         {0.95f, 0.85f * r, 0.80f * r, 0.35f * r},
                                         {0.955f, 0.82f * r, 0.76f * r, 0},
                                         {0.98f, 0.70f * r, 0.62f * r, 0},
                                         {1.00f, 0.45f * r, 0.40f * r, 0}}};
  std::vector<std::vector<Vec3f>> outlines;
  for (const Section& s : sections) {
    const float z = s.u * length, w = s.width, h = kApart + s.height, g = std::min(groove, 0.8f * w);
    const float corner = 0.45f * std::min(s.width, s.height);
    outlines.push_back({{kApart, -w, z},
                        {h - corner, -w, z},
                        {h - 0.3f * corner, -w + 0.3f * corner, z},
                        {h, -w + corner, z},
                        {h, w - corner, z},
                        {h - 0.3f * corner, w - 0.3f * corner, z},
                        {h - corner, w, z},
                        {kApart, w, z},
                        {kApart, g, z},
                        {kApart + s.depth, g, z},
                        {kApart + s.depth, -g, z},
                        {kApart, -g, z}});
  }
  AppendLoft(outlines, kPolishedSteel, &solid);
  // The leg of the next clip stands out of the groove.
  const std::array<Vec3f, 4> leg{Vec3f(0, 0, 0.27f * length), Vec3f(0, 0, 0.3f * length), Vec3f(0, 0, 0.91f * length),
                                 Vec3f(0, 0, 0.93f * length)};
  std::array<Vec3f, 4> path;
  std::ranges::transform(leg, path.begin(), [r](const Vec3f& p) { return Vec3f(p + Vec3f(0.15f * r, 0, 0)); });
  const std::array<float, 4> radii{0.25f * r, 0.36f * r, 0.36f * r, 0.25f * r};
  AppendTube(path, radii, 10, kTitanium, &solid);
  return solid;
}

Solid TitaniumClip(float length_m) {
  constexpr float kThick = 0.001f, kBetween = 0.0002f;  // Of a leg; from leg to leg [m].
  constexpr float kEye = 0.0007f;                       // Radius of the bend's middle line: wider than the legs.
  constexpr int kArc = 12;
  const float end = 0.5f * std::max(length_m, 4 * kThick), x = 0.5f * (kThick + kBetween);
  const float centre = -end + 0.5f * kThick + kEye, from = std::acos(x / kEye);
  // One leg, from its open end, the bend, and the other leg.
  std::vector<Vec3f> path{{x, 0, end}, {x, 0, end - 0.1e-3f}, {x, 0, end - 0.3e-3f}};
  for (int k = 0; k <= kArc; ++k) {
    const float share = static_cast<float>(k) / kArc;
    const float angle = from - share * (std::numbers::pi_v<float> + 2 * from);
    path.emplace_back(kEye * std::cos(angle), 0, centre + kEye * std::sin(angle));
  }
  for (const float below : {0.3e-3f, 0.1e-3f, 0.0f}) path.emplace_back(-x, 0, end - below);
  std::vector<float> halves(path.size(), 0.5f * kThick);
  halves.front() = halves.back() = 0.3f * kThick;
  halves[1] = halves[halves.size() - 2] = 0.45f * kThick;
  Solid solid;
  AppendWire(path, halves, kTitanium, &solid);
  return solid;
}

Solid SuctionTube(const ToolShape& shape) {
  Solid solid;
  const float r = shape.tip_radius_m;
  AppendStraightTube(-shape.shaft_length_m, -shape.tip_length_m, shape.shaft_radius_m, r, 24, kTube, &solid);
  // A rounded edge, within it the bore.
  const std::array<Vec3f, 4> path{Vec3f(0, 0, -shape.tip_length_m), Vec3f(0, 0, -0.3f * r), Vec3f(0, 0, -0.08f * r),
                                  Vec3f::Zero()};
  const std::array<float, 4> radii{r, r, 0.95f * r, 0.82f * r};
  AppendTube(path, radii, 24, kTube, &solid);
  const auto disc = [&solid](const Vec3f& centre, const Vec3f& normal, float radius) {
    constexpr int kSides = 14;
    const Vec3f u = normal.unitOrthogonal(), v = normal.cross(u);
    std::vector<Vec3f> outline;
    for (int k = 0; k < kSides; ++k) {
      const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kSides;
      outline.emplace_back(centre + radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
    AppendCap(outline, normal, kBore, &solid);
  };
  constexpr float kAbove = 2e-5f;  // [m]: the discs lie on the steel.
  disc(Vec3f(0, 0, kAbove), Vec3f::UnitZ(), 0.70f * r);
  // Side holes: a flat disc of this radius stays within a tenth of a millimetre of the round wall.
  const float hole = 0.26f * r;
  for (int k = 0; k < 8; ++k) {
    const float angle = std::numbers::pi_v<float> * (0.5f * static_cast<float>(k % 4) + (k < 4 ? 0.0f : 0.25f));
    const Vec3f out(std::cos(angle), std::sin(angle), 0);
    disc((r + kAbove) * out + Vec3f(0, 0, k < 4 ? -1.6f * r : -3.0f * r), out, hole);
  }
  return solid;
}

Solid Hook(const ToolShape& shape) {
  Solid solid;
  const float r = shape.tip_radius_m;
  AppendStraightTube(-shape.shaft_length_m, -kHookNeck - 0.004f, shape.shaft_radius_m, shape.shaft_radius_m, 24,
                     kInsulation, &solid);
  AppendStraightTube(-kHookNeck - 0.004f, -kHookNeck, 0.92f * shape.shaft_radius_m, 0.55f * shape.shaft_radius_m, 24,
                     kCeramic, &solid);
  const std::array<Vec3f, 7> path{Vec3f(0, 0, -kHookNeck),
                                  Vec3f(0, 0, -3 * r),
                                  Vec3f(0.1f * r, 0, -1.4f * r),
                                  Vec3f(0.5f * r, 0, -0.5f * r),
                                  Vec3f(1.4f * r, 0, -0.1f * r),
                                  Vec3f(3 * r, 0, 0),
                                  Vec3f(std::max(shape.tip_length_m, 4 * r), 0, 0)};
  const std::array<float, 7> radii{r, r, r, r, r, r, 0.8f * r};
  AppendTube(path, radii, 12, kSteel, &solid);
  return solid;
}

}  // namespace fulcrum::render
