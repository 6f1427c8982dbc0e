// The procedural anatomy: a folded tube under a draped sheet, in a retroperitoneal bed under an insufflated wall.
#include <cmath>
#include <numbers>

#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/geometry.h"

namespace fulcrum::scene {
namespace {

constexpr double kPi = std::numbers::pi;

// Profile of the sheet across the organ: it follows the organ for this angle from the top, then flares out until its
// slope reaches the last angle, over this length. Chosen by eye for a mesorectum opened from the front.
constexpr double kOverOrgan_rad = 0.90;
constexpr double kFlareSlope_rad = 0.14;
constexpr double kFlareLength_m = 0.008;
constexpr double kUndulation_m = 0.0003;  ///< Irregularity of sheet and surface, as in nature.

/// Drawn vertices per tube vertex along each direction. With 24 segments a chord is 0.04 mm off its arc: 0.4 pixels of
/// a picture of 1080 lines. Four draw the same picture (54 dB) for a tenth more time.
constexpr int kSurfaceRefinement = 2;

/// Geometry of the scene: the curved centre line and the surfaces around it, as functions of u in [0, 1] along the
/// organ (beyond: its straight continuation).
class Shape {
 public:
  Shape(const TubeSettings& tube, const MembraneSettings& membrane) : tube_(tube), membrane_(membrane) {}

  struct Frame {
    Vec3d centre, right, up;  ///< right about +x, up about +z (anterior), both across the centre line.
  };

  [[nodiscard]] Frame At(double u) const {
    const double v = 2 * u - 1, half = tube_.length_m / 2;
    // Parabola inside, its tangent outside.
    const double bend = std::abs(v) <= 1 ? v * v : 2 * std::abs(v) - 1;
    const double slope = std::abs(v) <= 1 ? 2 * v : std::copysign(2.0, v);
    const double inside = std::clamp(v, -1.0, 1.0), slope_at = kPi * tube_.lateral_bend_m * std::cos(kPi * inside);
    const double side = tube_.lateral_bend_m * std::sin(kPi * inside) + (v - inside) * slope_at;
    Frame frame;
    frame.centre = Vec3d(side, v * half, tube_.sagittal_bend_m * (bend - 0.5));
    const Vec3d tangent = Vec3d(slope_at, half, tube_.sagittal_bend_m * slope).normalized();
    frame.right = tangent.cross(Vec3d::UnitZ()).normalized();
    frame.up = frame.right.cross(tangent);
    return frame;
  }

  /// Outer radius of the organ at angle `theta` from the top.
  [[nodiscard]] double Radius(double u, double theta) const {
    const double w = 2 * kPi * std::clamp(u, 0.0, 1.0) * tube_.fold_count;
    return tube_.outer_radius_m +
           tube_.fold_depth_m * (0.60 * std::cos(w + 0.8 * std::sin(theta)) + 0.25 * std::cos(0.5 * w + 2 * theta) +
                                 0.15 * std::cos(1.7 * w - theta));
  }

  /// Point of the organ at `depth` below the outer surface.
  [[nodiscard]] Vec3d Organ(double u, double theta, double depth) const {
    const Frame f = At(u);
    return f.centre + (Radius(u, theta) - depth) * (std::cos(theta) * f.up + std::sin(theta) * f.right);
  }

  /// Point of the peritoneal sheet at arc length `w` across from the middle (right is positive), also beyond the
  /// membrane.
  [[nodiscard]] Vec3d Peritoneum(double u, double w) const {
    const Frame f = At(u);
    const double radius = Radius(u, 0.15) + membrane_.gap_m, arc = std::abs(w);
    const double over = kOverOrgan_rad * radius, k = 1 / kFlareLength_m;
    const double a = kOverOrgan_rad - kFlareSlope_rad, b = 1 / radius + k * a;
    // Slope against arc length, continuous with its derivative where the flare begins; integrated by midpoints.
    const auto slope = [&](double s) {
      return s <= over ? s / radius : kFlareSlope_rad + (a + b * (s - over)) * std::exp(-k * (s - over));
    };
    const int steps = 1 + static_cast<int>(arc / 0.0005);
    double across = 0, drop = 0;
    for (int i = 0; i < steps; ++i) {
      const double angle = slope((i + 0.5) * arc / steps);
      across += std::cos(angle) * arc / steps;
      drop += std::sin(angle) * arc / steps;
    }
    const double y = u * tube_.length_m;
    const double undulation = kUndulation_m * (std::sin(210 * y + 90 * w) + std::sin(340 * w - 120 * y + 1.0));
    return f.centre + std::copysign(across, w) * f.right + (radius - drop + undulation) * f.up;
  }

 private:
  const TubeSettings& tube_;
  const MembraneSettings& membrane_;
};

/// Kuhn's split of a brick: the six monotone paths from corner 000 to corner 111. It is the same in every brick, so the
/// diagonals of neighbours agree, also round the closed direction.
template <class Add>
void SplitInSix(const Add& add) {
  constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const auto& path : kPaths) {
    std::array<std::array<int, 3>, 4> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k + 1] = corners[k];
      corners[k + 1][static_cast<std::size_t>(path[k])] = 1;
    }
    add(corners);
  }
}

/// Split into five: four corners of the brick, no two of them neighbours, form a tetrahedron in the middle; each other
/// corner forms one with its three neighbours. The diagonal of every face joins two of the four. The four are those
/// whose coordinates add up to an even number over the whole tube, so that neighbours agree; `parity` is the sum at
/// corner 000.
template <class Add>
void SplitInFive(int parity, const Add& add) {
  std::array<std::array<int, 3>, 4> middle{};
  std::size_t count = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> at{corner & 1, corner >> 1 & 1, corner >> 2};
    if ((parity + at[0] + at[1] + at[2]) % 2 == 0) {
      middle[count++] = at;
      continue;
    }
    std::array<std::array<int, 3>, 4> corners{at, at, at, at};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k + 1][k] = 1 - at[k];
    }
    add(corners);
  }
  add(middle);
}

void AddTube(const TubeSettings& tube, const Shape& shape, SolidBody* out) {
  const int n = tube.segments;
  const auto id = [&](int ring, int segment, int layer) {
    return static_cast<Index>((ring * 2 + layer) * n + segment % n);
  };
  for (int ring = 0; ring < tube.rings; ++ring) {
    for (int layer = 0; layer < 2; ++layer) {
      for (int segment = 0; segment < n; ++segment) {
        out->vertices.push_back(shape.Organ(static_cast<double>(ring) / (tube.rings - 1), 2 * kPi * segment / n,
                                            layer == 0 ? tube.wall_m : 0));
        out->fixed.push_back(ring == 0 || ring == tube.rings - 1);
      }
    }
  }
  for (int ring = 0; ring + 1 < tube.rings; ++ring) {
    for (int segment = 0; segment < n; ++segment) {
      const auto add = [&](const std::array<std::array<int, 3>, 4>& corners) {
        Tetrahedron tet;
        for (std::size_t k = 0; k < 4; ++k) {
          tet[k] = id(ring + corners[k][0], segment + corners[k][1], corners[k][2]);
        }
        const auto& x = out->vertices;
        if (SignedVolume(x[tet[0]], x[tet[1]], x[tet[2]], x[tet[3]]) < 0) {
          std::swap(tet[2], tet[3]);
        }
        out->tets.push_back(tet);
      };
      tube.split == BrickSplit::kSix ? SplitInSix(add) : SplitInFive((ring + segment) % 2, add);
    }
  }
}

void AddFineSurface(const TubeSettings& tube, const Shape& shape, SolidBody* out) {
  const int rings = (tube.rings - 1) * kSurfaceRefinement + 1, n = tube.segments * kSurfaceRefinement;
  for (int ring = 0; ring < rings; ++ring) {
    for (int segment = 0; segment < n; ++segment) {
      const double u = static_cast<double>(ring) / (rings - 1), theta = 2 * kPi * segment / n;
      const double bump = kUndulation_m * std::sin(9 * theta + 40 * u) * std::sin(150 * u - 4 * theta);
      out->surface_vertices.push_back(shape.Organ(u, theta, -0.5 * bump));
    }
  }
  for (int ring = 0; ring + 1 < rings; ++ring) {
    for (int segment = 0; segment < n; ++segment) {
      const auto id = [&](int r, int s) { return static_cast<Index>(r * n + s % n); };
      // Along +y and then from the top to the right: the normal points outward.
      out->surface_triangles.push_back({id(ring, segment), id(ring, segment + 1), id(ring + 1, segment + 1)});
      out->surface_triangles.push_back({id(ring, segment), id(ring + 1, segment + 1), id(ring + 1, segment)});
    }
  }
}

std::vector<Vec3d> PeritoneumOf(const MembraneSettings& membrane, const Shape& shape) {
  std::vector<Vec3d> nodes;
  for (int r = 0; r < membrane.rows; ++r) {
    for (int c = 0; c < membrane.cols; ++c) {
      nodes.push_back(shape.Peritoneum(static_cast<double>(r) / (membrane.rows - 1),
                                       (static_cast<double>(c) / (membrane.cols - 1) - 0.5) * membrane.width_m));
    }
  }
  return nodes;
}

/// The fixed continuation of the sheet to the sides and beyond the ends. It begins slightly inside the membrane's rim
/// and slightly below it, so that no gap is visible between the fine rim and the coarse surface.
Anatomy::Surrounding Retroperitoneum(const TubeSettings& tube, const MembraneSettings& membrane, const Shape& shape) {
  constexpr double kOverlap_m = 0.0015, kBelow_m = 0.0004, kReach_m = 0.150;
  constexpr int kInner = 32, kOuter = 12;
  const double rim_u = kOverlap_m / tube.length_m, reach_u = 0.45 * kReach_m / tube.length_m;
  const double rim_w = membrane.width_m / 2 - kOverlap_m;
  std::vector<double> u_lines, w_lines;
  for (int i = 0; i < kOuter; ++i) {
    u_lines.push_back(rim_u - (reach_u + rim_u) * std::pow(1 - static_cast<double>(i) / kOuter, 1.5));
    w_lines.push_back(-rim_w - kReach_m * std::pow(1 - static_cast<double>(i) / kOuter, 1.5));
  }
  for (int i = 0; i <= kInner; ++i) {
    u_lines.push_back(rim_u + (1 - 2 * rim_u) * i / kInner);
    w_lines.push_back(-rim_w + 2 * rim_w * i / kInner);
  }
  for (int i = kOuter - 1; i >= 0; --i) {
    u_lines.push_back(1 - u_lines[i]);
    w_lines.push_back(-w_lines[i]);
  }
  Anatomy::Surrounding result{"retroperitoneum", SurfaceRole::kRetroperitoneum, true, {}, {}};
  const int rows = static_cast<int>(u_lines.size()), cols = static_cast<int>(w_lines.size());
  for (const double u : u_lines) {
    for (const double w : w_lines) {
      result.vertices.push_back(shape.Peritoneum(u, w) - kBelow_m * shape.At(u).up);
    }
  }
  for (const Triangle& t : GridTriangles(rows, cols)) {
    const auto inside = [&](Index v) {
      const int r = static_cast<int>(v) / cols, c = static_cast<int>(v) % cols;
      return r >= kOuter && r <= kOuter + kInner && c >= kOuter && c <= kOuter + kInner;
    };
    if (!(inside(t[0]) && inside(t[1]) && inside(t[2]))) {
      result.triangles.push_back(t);
    }
  }
  return result;
}

/// The bed below the organ: a trough from one rim of the membrane to the other.
Anatomy::Surrounding PelvicFloor(const TubeSettings& tube, const MembraneSettings& membrane, const Shape& shape) {
  constexpr int kRows = 33, kCols = 25;
  constexpr double kClearance_m = 0.006;
  Anatomy::Surrounding result{"pelvic floor", SurfaceRole::kPelvis, true, {}, {}};
  for (int r = 0; r < kRows; ++r) {
    const double u = -0.05 + 1.1 * r / (kRows - 1);
    const Shape::Frame f = shape.At(u);
    const Vec3d left = shape.Peritoneum(u, -membrane.width_m / 2), right = shape.Peritoneum(u, membrane.width_m / 2);
    const double top = 0.5 * (left + right - 2 * f.centre).dot(f.up) - 0.002;
    const double half = 0.5 * (right - left).dot(f.right);
    const double depth = tube.outer_radius_m + tube.fold_depth_m + kClearance_m + top;
    for (int c = 0; c < kCols; ++c) {
      const double angle = kPi * c / (kCols - 1);
      result.vertices.push_back(f.centre - half * std::cos(angle) * f.right + (top - depth * std::sin(angle)) * f.up);
    }
  }
  result.triangles = GridTriangles(kRows, kCols);
  return result;
}

/// The insufflated wall: half an ellipsoid, seen from inside.
Anatomy::Surrounding AbdominalWall() {
  constexpr int kRows = 17, kCols = 49;
  constexpr double kLift_m = -0.03;
  const Vec3d radii(0.155, 0.185, 0.185);
  Anatomy::Surrounding result{"abdominal wall", SurfaceRole::kAbdominalWall, false, {}, {}};
  for (int r = 0; r < kRows; ++r) {
    // Ends before the pole: a degenerate row of triangles would have no normal.
    const double latitude = 0.5 * kPi * r / (kRows - 1) * 0.995;
    for (int c = 0; c < kCols; ++c) {
      const double longitude = -2 * kPi * c / (kCols - 1);
      result.vertices.push_back(Vec3d(radii.x() * std::cos(latitude) * std::cos(longitude),
                                      radii.y() * std::cos(latitude) * std::sin(longitude),
                                      kLift_m + radii.z() * std::sin(latitude)));
    }
  }
  result.triangles = GridTriangles(kRows, kCols);
  return result;
}

}  // namespace

SolidBody OrganOf(const SceneSettings& settings) {
  SolidBody organ;
  organ.name = "organ";
  organ.material = {settings.organ_look, settings.physics.tube_youngs_modulus_Pa, settings.organ_density_kg_m3};
  return organ;
}

Anatomy ProceduralAnatomy(const SceneSettings& settings) {
  if (settings.tube.split == BrickSplit::kFive && settings.tube.segments % 2 != 0) {
    throw InputError("scene '" + settings.name + "': " + std::to_string(settings.tube.segments) +
                     " segments; valid with a split in five: an even number");
  }
  const Shape shape(settings.tube, settings.membrane);
  Anatomy anatomy;
  SolidBody& organ = anatomy.solids.emplace_back(OrganOf(settings));
  AddTube(settings.tube, shape, &organ);
  AddFineSurface(settings.tube, shape, &organ);
  anatomy.sheets.push_back(MembraneOf(settings, PeritoneumOf(settings.membrane, shape)));
  anatomy.surroundings = {Retroperitoneum(settings.tube, settings.membrane, shape),
                          PelvicFloor(settings.tube, settings.membrane, shape), AbdominalWall()};
  return anatomy;
}

SceneData BuildProcedural(const SceneSettings& settings) {
  if (settings.import || !settings.bodies.empty() || !settings.sheets.empty() || !settings.has_organ) {
    throw InputError("scene '" + settings.name +
                     "': only a procedural organ without further bodies or sheets is procedural");
  }
  return AssembleScene(settings, ProceduralAnatomy(settings));
}

}  // namespace fulcrum::scene
