#include "services/scene/builder/attachments.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>

#include "services/base/core/solids.h"
#include "services/scene/builder/geometry.h"

namespace fulcrum::scene {
namespace {

constexpr double kLeastLength_m = 1e-3;  ///< Of a column, where bodies touch.
constexpr double kStiffest_N_per_m = 1e5;
/// Surfaces lie against each other where their normals are less than 75 degrees from opposite, so that the corners of a
/// block count and its sides do not, and the way from one to the other less than 45 degrees from the normal: elsewhere
/// a spring along that way would hold what slides.
constexpr double kLeastFacing = 0.25, kLeastAlongNormal = 0.7;
/// Nearer than this the way between two surfaces has no direction [m].
constexpr double kTouching_m = 1e-6;

/// A region where the scene is: in W.
class Region {
 public:
  Region(const RegionSettings& settings, const Anatomy& anatomy) : settings_(settings), anatomy_(anatomy) {
    const Vec3d turn = settings.turn_rad.cast<double>();
    R_FR_ = (Eigen::AngleAxisd(turn.z(), Vec3d::UnitZ()) * Eigen::AngleAxisd(turn.y(), Vec3d::UnitY()) *
             Eigen::AngleAxisd(turn.x(), Vec3d::UnitX()))
                .toRotationMatrix();
  }
  [[nodiscard]] const std::string& name() const { return settings_.name; }
  /// Of a point in W [m], 0 inside. Of an ellipsoid along the line to its middle.
  [[nodiscard]] double DistanceOf(const Vec3d& p_W) const {
    const Vec3d p_F = anatomy_.R_WF.transpose() * p_W + anatomy_.origin_m;
    const Vec3d p = R_FR_.transpose() * (p_F - settings_.at_m.cast<double>()), half = settings_.half_m.cast<double>();
    if (settings_.is_box) return (p.cwiseAbs() - half).cwiseMax(0.0).norm();
    const double radii = p.cwiseQuotient(half).norm();
    return radii > 1 ? p.norm() * (1 - 1 / radii) : 0;
  }

 private:
  const RegionSettings& settings_;
  const Anatomy& anatomy_;
  Mat3d R_FR_;
};

/// The surface of a body, as far as it may be joined.
struct JoinedSurface {
  std::vector<Triangle> triangles;  ///< Of the whole body.
  std::vector<Vec3d> area;          ///< By vertex of all: its share of the triangles times their normals [m^2].
  std::vector<double> share;        ///< By vertex of all: of their area; 0 for those of other bodies [m^2].
};

JoinedSurface SurfaceOf(Index body, const std::vector<Index>& solid, const std::vector<Vec3d>& vertices,
                        const std::vector<Triangle>& surface) {
  JoinedSurface of{{}, std::vector<Vec3d>(vertices.size(), Vec3d::Zero()), std::vector<double>(vertices.size())};
  for (const Triangle& t : surface) {
    if (solid[t[0]] != body) continue;
    of.triangles.push_back(t);
    const Vec3d &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    const Vec3d twice = (b - a).cross(c - a);
    for (const Index v : t) {
      of.share[v] += twice.norm() / 6;
      of.area[v] += twice / 6;
    }
  }
  return of;
}

/// Nearest vertex of a surface: what an error names.
template <class Distance>
std::pair<Index, double> NearestVertex(const JoinedSurface& surface, const Distance& distance) {
  std::pair<Index, double> nearest{0, std::numeric_limits<double>::max()};
  for (Index v = 0; v < surface.share.size(); ++v) {
    if (!(surface.share[v] > 0)) continue;
    if (const double d = distance(v); d < nearest.second) nearest = {v, d};
  }
  return nearest;
}

class Joiner {
 public:
  Joiner(const SceneSettings& settings, const Anatomy& anatomy, const std::vector<Vec3d>& vertices, SceneData* scene)
      : settings_(settings),
        anatomy_(anatomy),
        vertices_(vertices),
        scene_(*scene),
        solid_(SolidOfVertices(scene->View())) {}

  void Join(const AttachSettings& attach) {
    const JoinedSurface from = SurfaceOf(BodyNamed(attach.from), solid_, vertices_, scene_.tube_surface);
    JoinedSurface to = SurfaceOf(BodyNamed(attach.to), solid_, vertices_, scene_.tube_surface);
    const std::optional<Region> from_region = RegionNamed(attach.from_region),
                                to_region = RegionNamed(attach.to_region);
    if (from_region && NearestTo(*from_region, from).second > 0) RefuseRegion(attach.from, *from_region, from);
    if (to_region) {
      if (NearestTo(*to_region, to).second > 0) RefuseRegion(attach.to, *to_region, to);
      std::erase_if(to.triangles, [&](const Triangle& t) {
        return std::ranges::none_of(t, [&](Index v) { return to_region->DistanceOf(vertices_[v]) == 0; });
      });
    }
    const TriangleLocator locator(vertices_, to.triangles);
    std::size_t joined = 0, near = 0;
    for (Index v = 0; v < vertices_.size(); ++v) {
      if (!(from.share[v] > 0) || (from_region && from_region->DistanceOf(vertices_[v]) > 0)) continue;
      const auto hit = locator.Closest(vertices_[v], attach.reach_m);
      if (hit.triangle == kNoIndex) continue;
      ++near;
      Attachment a{v, to.triangles[hit.triangle], {}, 0};
      for (int k = 0; k < 3; ++k) a.barycentric[k] = static_cast<float>(hit.closest.barycentric[k]);
      const double stiffness =
          attach.youngs_modulus_Pa * from.share[v] / std::max(hit.closest.distance, kLeastLength_m);
      a.stiffness_N_per_m = static_cast<float>(std::min(stiffness, kStiffest_N_per_m));
      if (attach.kind == AttachKind::kSliding) {
        const std::optional<Vec3d> normal = SlidingNormal(from.area[v], a.surface, hit.closest, v);
        if (!normal) continue;
        a.normal = normal->cast<float>().normalized();
      }
      scene_.attachments.push_back(a);
      ++joined;
    }
    if (joined == 0) RefuseNothing(attach, near, from_region, from, to);
  }

 private:
  Index BodyNamed(const std::string& name) const {
    const auto at = std::ranges::find(anatomy_.solids, name, &SolidBody::name);
    if (at == anatomy_.solids.end()) Refuse(settings_, "attach: no body '" + name + "'");
    return static_cast<Index>(at - anatomy_.solids.begin());
  }
  std::optional<Region> RegionNamed(const std::string& name) const {
    if (name.empty()) return std::nullopt;
    const auto at = std::ranges::find(settings_.regions, name, &RegionSettings::name);
    if (at == settings_.regions.end()) Refuse(settings_, "attach: no region '" + name + "'");
    return Region(*at, anatomy_);
  }
  std::pair<Index, double> NearestTo(const Region& region, const JoinedSurface& surface) const {
    return NearestVertex(surface, [&](Index v) { return region.DistanceOf(vertices_[v]); });
  }
  /// From the surface towards the side on which the gap is positive, in the direction of the spring.
  std::optional<Vec3d> SlidingNormal(const Vec3d& from_area, const Triangle& to, const ClosestPoint& closest,
                                     Index v) const {
    const Vec3d &a = vertices_[to[0]], &b = vertices_[to[1]], &c = vertices_[to[2]];
    const Vec3d outward = (b - a).cross(c - a).normalized(), way = vertices_[v] - closest.point;
    if (!(-outward.dot(from_area) > kLeastFacing * from_area.norm())) return std::nullopt;
    if (!(way.norm() > kTouching_m)) return outward;
    const double along = outward.dot(way) / way.norm();
    if (!(std::abs(along) > kLeastAlongNormal)) return std::nullopt;
    return Vec3d(std::copysign(1.0, along) * way.normalized());
  }
  /// Of a point, in the frame of the description [mm].
  std::string PlaceOf(Index v) const {
    const Vec3d p = 1e3 * (anatomy_.R_WF.transpose() * vertices_[v] + anatomy_.origin_m);
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << p.x() << ' ' << p.y() << ' ' << p.z() << " mm";
    return text.str();
  }
  [[noreturn]] void RefuseRegion(const std::string& body, const Region& region, const JoinedSurface& surface) const {
    const auto [v, distance] = NearestTo(region, surface);
    std::ostringstream text;
    text << "attach: nothing of the surface of '" << body << "' lies in region '" << region.name()
         << "'; its nearest vertex is " << 1e3 * distance << " mm outside, at " << PlaceOf(v)
         << ": move or enlarge the region";
    Refuse(settings_, text.str());
  }
  [[noreturn]] void RefuseNothing(const AttachSettings& attach, std::size_t near, const std::optional<Region>& within,
                                  const JoinedSurface& from, const JoinedSurface& to) const {
    std::ostringstream text;
    if (near > 0) {
      text << "attach: '" << attach.from << "' and '" << attach.to << "' face each other nowhere within "
           << 1e3 * attach.reach_m << " mm (" << near
           << " vertices are near, but beside or behind the surface), so nothing can slide; attach them by kind glued, "
              "or move the bodies";
      Refuse(settings_, text.str());
    }
    const auto [v, distance] = NearestVertex(from, [&](Index i) {
      if (within && within->DistanceOf(vertices_[i]) > 0) return std::numeric_limits<double>::max();
      double least = std::numeric_limits<double>::max();
      for (const Triangle& t : to.triangles) {
        least = std::min(least,
                         ClosestOnTriangle(vertices_[i], vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]).distance);
      }
      return least;
    });
    text << "attach: no vertex of '" << attach.from << "' lies within " << 1e3 * attach.reach_m << " mm of '"
         << attach.to << "'; the nearest, at " << PlaceOf(v) << ", is " << 1e3 * distance
         << " mm away: raise reach_mm, or move the bodies";
    Refuse(settings_, text.str());
  }

  const SceneSettings& settings_;
  const Anatomy& anatomy_;
  const std::vector<Vec3d>& vertices_;
  SceneData& scene_;
  const std::vector<Index> solid_;
};

}  // namespace

void AddAttachments(const SceneSettings& settings, const Anatomy& anatomy, const std::vector<Vec3d>& vertices,
                    SceneData* scene) {
  if (settings.attach.empty()) return;
  if (settings.physics.mode != PhysicsMode::kAccurate) {
    Refuse(settings, "attach: only `physics.mode: accurate` has attachments");
  }
  Joiner joiner(settings, anatomy, vertices, scene);
  for (const AttachSettings& attach : settings.attach) joiner.Join(attach);
}

}  // namespace fulcrum::scene
