#include "services/apps/replayer/truth.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render_node/geometry/cut_lip.h"

namespace fulcrum::replay {
namespace {

using render::DrawnSurface;
using render::Hit;

/// What is farther behind the nearest surface than this is hidden [m]; the surface of a neighbouring pixel that is seen
/// at a flat angle is that much nearer.
constexpr double kHidden_m = 0.0005, kHiddenBySelf_m = 0.002;

/// The burns have the triangles of the solids' surface: their depths differ by rounding only [m].
constexpr float kSameSurface_m = 1e-4f;

std::string KeyOf(const DrawnSurface& surface) {
  return surface.name + " " + std::to_string(surface.tool) + " " + std::to_string(surface.part);
}

template <class T>
T Between(const std::vector<T>& corners, const Triangle& triangle, const Hit& hit) {
  const T &a = corners[triangle[0]], &b = corners[triangle[1]], &c = corners[triangle[2]];
  if constexpr (std::is_same_v<T, Vec3d>) {
    const auto b1 = static_cast<double>(hit.b1), b2 = static_cast<double>(hit.b2);
    return (1 - b1 - b2) * a + b1 * b + b2 * c;
  } else {
    T mean{};
    for (std::size_t k = 0; k < mean.size(); ++k)
      mean[k] = (1 - hit.b1 - hit.b2) * a[k] + hit.b1 * b[k] + hit.b2 * c[k];
    return mean;
  }
}

std::uint16_t Rounded(double value, double most) {
  return static_cast<std::uint16_t>(std::floor(std::clamp(value, 0.0, most) + 0.5));
}

TruthClass ClassOfTool(ToolKind kind) {
  return kind == ToolKind::kHook          ? TruthClass::kHook
         : kind == ToolKind::kScissors    ? TruthClass::kScissors
         : kind == ToolKind::kSuction     ? TruthClass::kSuction
         : kind == ToolKind::kClipApplier ? TruthClass::kClipApplier
                                          : TruthClass::kGrasper;
}

TruthClass ClassOfSurface(const DrawnSurface& surface, const std::array<ToolKind, kMaxTools>& kinds) {
  if (surface.tool >= 0) return ClassOfTool(kinds[static_cast<std::size_t>(surface.tool)]);
  if (surface.name == "rectum") return TruthClass::kRectum;
  if (surface.name == "organ") return TruthClass::kOrgan;
  if (surface.name == "fat") return TruthClass::kFat;
  if (surface.name == "clip") return TruthClass::kClip;
  const bool of_sheet = surface.name == "membrane" || surface.name == "cut";
  return of_sheet ? TruthClass::kMembrane : TruthClass::kSurroundings;
}

/// A value of a triangle, made once for neighbours in a row that show the same one.
template <class Value>
class OfTriangle {
 public:
  template <class Make>
  const Value& At(const Hit& hit, const Make& make) {
    if (hit.surface != surface_ || hit.triangle != triangle_) value_ = make(hit);
    surface_ = hit.surface;
    triangle_ = hit.triangle;
    return value_;
  }

 private:
  std::int32_t surface_ = -1;
  std::uint32_t triangle_ = 0;
  Value value_{};
};

/// Charts of a burn's corners, each once.
std::vector<Index> ChartsOf(const DrawnSurface& burn) {
  std::vector<Index> charts;
  for (const auto& corner : burn.coordinates) {
    const auto chart = static_cast<Index>(std::lround(corner[2]));
    if (charts.empty() || charts.back() != chart) charts.push_back(chart);
  }
  std::sort(charts.begin(), charts.end());
  charts.erase(std::unique(charts.begin(), charts.end()), charts.end());
  return charts;
}

}  // namespace

const char* NameOf(TruthClass what) {
  constexpr std::array<const char*, kTruthClasses> kNames{"none",     "surroundings", "rectum",       "fat",
                                                          "membrane", "grasper",      "hook",         "scissors",
                                                          "organ",    "suction",      "clip_applier", "clip"};
  return kNames[static_cast<std::size_t>(what)];
}

bool IsTool(TruthClass what) {
  return (what >= TruthClass::kGrasper && what <= TruthClass::kScissors) || what == TruthClass::kSuction ||
         what == TruthClass::kClipApplier;
}

Moment::Moment(render::LaparoscopeView* view, const render::Laparoscope& from, const SceneView& scene, int columns,
               int rows)
    : scope(from),
      width(columns),
      height(rows),
      surfaces(render::DrawnSurfaces(view->root())),
      atlas(view->atlas()),
      draws_cuts(render::DrawsCuts(scene)),
      burn(render::DrawnBurn(view->root())) {
  for (std::size_t k = 0; k < kMaxTools; ++k) kinds[k] = scene.tools[k].kind;
  if (burn) burnt = render::BurnCharts(view->burn_atlas(), ChartsOf(*burn));
}

Truth::Truth(Moment moment)
    : view_(moment.scope.view.cast<double>()),
      kinds_(moment.kinds),
      surfaces_(std::move(moment.surfaces)),
      raster_(render::PinholeOf(moment.scope, moment.width, moment.height)),
      temperature_(moment.width, moment.height, 16, 1),
      damage_(moment.width, moment.height, 8, 1),
      water_(moment.width, moment.height, 8, 1) {
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    index_[KeyOf(surfaces_[i])] = i;
    classes_.push_back(ClassOfSurface(surfaces_[i], kinds_));
  }
  Draw(moment.atlas, moment.draws_cuts);
  TakeHeat(moment.atlas);
  if (moment.burn) TakeHeatOfSolids(*moment.burn, moment.burnt);
}

std::vector<Vec3d> Truth::InCamera(const DrawnSurface& surface) const {
  const Eigen::Matrix3d turn = view_.topLeftCorner<3, 3>();
  const Vec3d place = view_.topRightCorner<3, 1>();
  std::vector<Vec3d> positions;
  positions.reserve(surface.positions_W.size());
  for (const Vec3d& p_W : surface.positions_W) positions.push_back(turn * p_W + place);
  return positions;
}

void Truth::Draw(const render::Atlas& atlas, bool draws_cuts) {
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    const DrawnSurface& surface = surfaces_[i];
    render::RasterOptions options{.behind_m = surface.behind_m, .cull_back = surface.cull_back};
    const auto removed = [&atlas, draws_cuts](const Corner& at) { return draws_cuts && atlas.Removed({at[0], at[1]}); };
    const auto at = [&surface](std::uint32_t triangle, float b1, float b2) {
      return Between(surface.coordinates, surface.triangles[triangle], {0, triangle, b1, b2, 0});
    };
    if (surface.name == "membrane") {
      options.shown = [=, &atlas](std::uint32_t triangle, float b1, float b2) {
        const Corner corner = at(triangle, b1, b2);
        // Beside a cut its lips are shown instead.
        if (corner[2] < 0 || removed(corner)) return false;
        return !draws_cuts || atlas.Nearness({corner[0], corner[1]}) <= render::kLipNearness;
      };
    } else if (surface.name == "fat") {
      options.shown = [=](std::uint32_t triangle, float b1, float b2) {
        const Corner corner = at(triangle, b1, b2);
        return corner[3] > 0.5f || removed(corner);
      };
    }
    raster_.Add(static_cast<std::int32_t>(i), InCamera(surface), surface.triangles, options);
  }
}

void Truth::TakeHeat(const render::Atlas& atlas) {
  const int width = camera().width, height = camera().height;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto corner = CoordinateOf(raster_.At(x, height - 1 - y));
      const auto texel = corner ? atlas.At({(*corner)[0], (*corner)[1]}) : std::nullopt;
      if (texel) SetHeat(x, y, *texel);
    }
  }
}

void Truth::TakeHeatOfSolids(const DrawnSurface& burn, const render::BurnCharts& charts) {
  const auto texel_at = [&](std::uint32_t triangle, float b1, float b2) {
    const Corner at = Between(burn.coordinates, burn.triangles[triangle], {0, triangle, b1, b2, 0});
    return charts.At(static_cast<Index>(std::lround(at[2])), {at[0], at[1]});
  };
  render::Rasteriser raster(camera());
  const std::vector<Vec3d> positions = InCamera(burn);
  render::RasterOptions options{.behind_m = burn.behind_m, .cull_back = burn.cull_back};
  // A triangle over the border of two charts is there for each. Where both have texels, those that have changed show,
  // as in the picture: of two equal depths the first stays.
  for (const bool changed_only : {true, false}) {
    options.shown = [&texel_at, &charts, changed_only](std::uint32_t triangle, float b1, float b2) {
      const auto texel = texel_at(triangle, b1, b2);
      return texel && (!changed_only || *texel != charts.intact());
    };
    raster.Add(0, positions, burn.triangles, options);
  }
  const int width = camera().width, height = camera().height;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Hit &solid = raster_.At(x, height - 1 - y), &over = raster.At(x, height - 1 - y);
      if (const TruthClass what = ClassOf(solid); what != TruthClass::kRectum && what != TruthClass::kOrgan) continue;
      if (!over.any() || std::abs(over.depth_m - solid.depth_m) > kSameSurface_m) continue;
      if (const auto texel = texel_at(over.triangle, over.b1, over.b2)) SetHeat(x, y, *texel);
    }
  }
}

void Truth::SetHeat(int x, int y, const std::array<std::uint8_t, 4>& texel) {
  const double celsius = 20 + 0.5 * texel[0];  // As membrane.frag reads them.
  temperature_.At(x, y) = Rounded(celsius / kTemperatureUnit_C, 65535);
  damage_.At(x, y) = texel[1];
  water_.At(x, y) = Rounded(255 - 2.0 * texel[2], 255);
}

std::optional<Truth::Corner> Truth::CoordinateOf(const Hit& hit) const {
  if (!hit.any()) return std::nullopt;
  if (const TruthClass what = ClassOf(hit); what != TruthClass::kMembrane && what != TruthClass::kFat)
    return std::nullopt;
  const DrawnSurface& surface = surfaces_[static_cast<std::size_t>(hit.surface)];
  return Between(surface.coordinates, surface.triangles[hit.triangle], hit);
}

std::optional<Vec2d> Truth::MaterialOf(const Hit& hit) const {
  const auto corner = CoordinateOf(hit);
  return corner ? std::optional(Vec2d((*corner)[0], (*corner)[1])) : std::nullopt;
}

std::pair<Vec2d, double> Truth::PlaceOf(const Vec3d& p_W) const {
  const Vec3d p = (view_ * p_W.homogeneous()).head<3>();
  return {camera().Project(p), -p.z()};
}

bool Truth::Sees(const Vec3d& p_W, double tolerance_m) const {
  const auto [pixel, depth] = PlaceOf(p_W);
  if (depth <= 0 || !camera().Shows(pixel)) return false;
  const Hit& hit = raster_.At(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
  return !hit.any() || depth < static_cast<double>(hit.depth_m) + tolerance_m;
}

Eigen::Matrix4d Truth::world_to_camera() const {
  Eigen::Matrix4d flip = Eigen::Matrix4d::Identity();
  flip(1, 1) = flip(2, 2) = -1;
  return flip * view_;
}

TruthClass Truth::ClassOf(const Hit& hit) const {
  return hit.any() ? classes_[static_cast<std::size_t>(hit.surface)] : TruthClass::kNone;
}

int Truth::InstanceOf(const Hit& hit) const {
  if (!hit.any()) return 0;
  const DrawnSurface& surface = surfaces_[static_cast<std::size_t>(hit.surface)];
  if (surface.tool >= 0) return kFirstToolInstance + surface.tool;
  const TruthClass what = ClassOf(hit);
  return what == TruthClass::kOrgan  ? kFirstOrganInstance + surface.part
         : what == TruthClass::kClip ? kFirstClipInstance + surface.part
                                     : static_cast<int>(what);
}

TruthClass Truth::ClassOf(int instance) const {
  if (instance >= kFirstClipInstance) return TruthClass::kClip;
  if (instance >= kFirstOrganInstance) return TruthClass::kOrgan;
  if (instance < kFirstToolInstance) return static_cast<TruthClass>(instance);
  return ClassOfTool(kinds_[static_cast<std::size_t>(instance - kFirstToolInstance)]);
}

Vec3d Truth::PointOf(const Hit& hit) const {
  const DrawnSurface& surface = surfaces_[static_cast<std::size_t>(hit.surface)];
  return Between(surface.positions_W, surface.triangles[hit.triangle], hit);
}

Vec3d Truth::NormalOf(const Hit& hit) const {
  const DrawnSurface& surface = surfaces_[static_cast<std::size_t>(hit.surface)];
  const Triangle& t = surface.triangles[hit.triangle];
  const Vec3d &a = surface.positions_W[t[0]], &b = surface.positions_W[t[1]], &c = surface.positions_W[t[2]];
  return (b - a).cross(c - a).normalized();
}

template <class Value>
Channel Truth::Make(int bits, int samples, const Value& value) const {
  Channel channel(camera().width, camera().height, bits, samples);
  for (int y = 0; y < channel.height; ++y) {
    for (int x = 0; x < channel.width; ++x) {
      const Hit& hit = raster_.At(x, channel.height - 1 - y);
      if (hit.any()) value(hit, x, y, &channel.At(x, y));
    }
  }
  return channel;
}

Channel Truth::Classes() const {
  return Make(8, 1, [this](const Hit& hit, int, int, std::uint16_t* pixel) {
    *pixel = static_cast<std::uint16_t>(ClassOf(hit));
  });
}

Channel Truth::Instances() const {
  return Make(8, 1, [this](const Hit& hit, int, int, std::uint16_t* pixel) {
    *pixel = static_cast<std::uint16_t>(InstanceOf(hit));
  });
}

Channel Truth::Depth() const {
  return Make(16, 1, [](const Hit& hit, int, int, std::uint16_t* pixel) {
    *pixel = Rounded(static_cast<double>(hit.depth_m) / kDepthUnit_m, 65535);
  });
}

Channel Truth::Normals() const {
  const Eigen::Matrix3d turn = world_to_camera().topLeftCorner<3, 3>();
  const Vec3d eye_W = -view_.topLeftCorner<3, 3>().transpose() * view_.topRightCorner<3, 1>();
  OfTriangle<Vec3d> normals;
  return Make(8, 3, [&](const Hit& hit, int, int, std::uint16_t* pixel) {
    Vec3d normal = normals.At(hit, [this](const Hit& first) { return NormalOf(first); });
    if (normal.dot(PointOf(hit) - eye_W) > 0) normal = -normal;
    const Vec3d coded = 127.5 * (turn * normal + Vec3d::Ones());
    for (int k = 0; k < 3; ++k) pixel[k] = Rounded(coded[k], 255);
  });
}

std::vector<const DrawnSurface*> Truth::SurfacesIn(const Truth& other) const {
  std::vector<const DrawnSurface*> then;
  for (const DrawnSurface& surface : surfaces_) {
    const auto found = other.index_.find(KeyOf(surface));
    then.push_back(found == other.index_.end() ? nullptr : &other.surfaces_[found->second]);
  }
  return then;
}

bool Truth::IsSame(const Hit& hit, const DrawnSurface* then) const {
  if (then == nullptr) return false;
  const DrawnSurface& surface = surfaces_[static_cast<std::size_t>(hit.surface)];
  const bool cut = ClassOf(hit) == TruthClass::kMembrane;
  for (const Index corner : surface.triangles[hit.triangle]) {
    if (corner >= then->positions_W.size()) return false;
    // Corners of cut triangles get other numbers when the cut goes on.
    const auto differs = [&](std::size_t k) { return then->coordinates[corner][k] != surface.coordinates[corner][k]; };
    if (cut && (differs(0) || differs(1) || differs(2))) return false;
  }
  return true;
}

double Truth::Footprint(const Hit& hit) const {
  constexpr double kFlattest = 0.1;  // Cosine.
  const Vec3d ray = PointOf(hit) + view_.topLeftCorner<3, 3>().transpose() * view_.topRightCorner<3, 1>();
  const double facing = std::abs(NormalOf(hit).dot(ray.normalized()));
  return static_cast<double>(hit.depth_m) / camera().focal / std::max(kFlattest, facing);
}

template <class SamePlace>
FlowState Truth::StateOf(const Vec2d& place, double depth_m, const DrawnSurface* surface,
                         const std::optional<Vec2d>& material, const SamePlace& is_same) const {
  if (!camera().Shows(place)) return FlowState::kHidden;
  const Hit& hit = raster_.At(static_cast<int>(place.x()), static_cast<int>(place.y()));
  const bool self = hit.any() && &surfaces_[static_cast<std::size_t>(hit.surface)] == surface;
  if (depth_m > static_cast<double>(hit.depth_m) + (self ? kHiddenBySelf_m : kHidden_m)) return FlowState::kHidden;
  if (!material) return FlowState::kVisible;
  // Of a sheet that has been cut or burnt away meanwhile nothing is there.
  const auto there = MaterialOf(hit);
  return self && there && is_same((*there - *material).norm()) ? FlowState::kVisible : FlowState::kNone;
}

Channel Truth::FlowTo(const Truth& next) const {
  constexpr double kSamePlace = 3;  // Pixels: the nearest pixel is up to 0.7 away, on a sheet that may be stretched.
  const std::vector<const DrawnSurface*> surfaces = SurfacesIn(next);
  OfTriangle<bool> stays;
  return Make(16, 3, [&](const Hit& hit, int x, int y, std::uint16_t* pixel) {
    const DrawnSurface* then = surfaces[static_cast<std::size_t>(hit.surface)];
    if (!stays.At(hit, [&](const Hit& first) { return IsSame(first, then); })) return;
    const Triangle& triangle = surfaces_[static_cast<std::size_t>(hit.surface)].triangles[hit.triangle];
    const auto [place, depth] = next.PlaceOf(Between(then->positions_W, triangle, hit));
    if (depth <= 0) {  // Behind the camera.
      pixel[2] = static_cast<std::uint16_t>(FlowState::kHidden);
      return;
    }
    const auto is_same = [&](double apart_m) {
      // The footprint, which takes longer to compute, is never less than that of a surface that faces the camera.
      return apart_m < kSamePlace * static_cast<double>(hit.depth_m) / camera().focal ||
             apart_m < kSamePlace * Footprint(hit);
    };
    FlowState state = next.StateOf(place, depth, then, MaterialOf(hit), is_same);
    const double right = place.x() - (x + 0.5), down = (camera().height - place.y()) - (y + 0.5);
    const double u = 32768 + right / kFlowUnit_px, v = 32768 + down / kFlowUnit_px;
    const bool holds = u >= 1 && v >= 1 && u <= 65535 && v <= 65535;
    if (state == FlowState::kVisible && !holds) state = FlowState::kFar;
    pixel[2] = static_cast<std::uint16_t>(state);
    if (state == FlowState::kNone || !holds) return;
    pixel[0] = Rounded(u, 65535);
    pixel[1] = Rounded(v, 65535);
  });
}

}  // namespace fulcrum::replay
