#include "tests/integration/render/synthetic_clips.h"

#include <cmath>

#include "services/base/core/clips.h"

namespace fulcrum::render {
namespace {

// A vessel of the sheet's pattern runs along s here; the crest of the fold lies behind it, so that the scope sees the
// vessel on the flank [m].
const Vec2f kVessel(0.0401f, 0.0919f);
const Vec2f kPlace = kVessel + Vec2f(0, 0.0028f);
constexpr float kHalfDistance = 0.0035f;  // Of the clips [m].
constexpr float kFold = 0.006f;           // Height of the fold [m].
constexpr float kLength = 0.008f;         // Of a clip [m].

/// Displaces the sheet into a fold along s whose crest is at t of kPlace.
void Fold(const SceneView& scene, std::vector<float>* xyz) {
  for (Index node = 0; node < scene.membrane.node_count(); ++node) {
    const Vec2f from = scene.membrane_material[node] - kPlace;
    const float along = std::abs(from.x()), across = std::abs(from.y());
    const float share = 1 / (1 + std::pow(along / 0.011f, 4.0f));
    // Drawn together by the clips, a little apart elsewhere.
    const float apart = 0.0001f + 0.10f * std::min(0.01f, std::abs(along - kHalfDistance));
    const float height = kFold * share * std::max(0.0f, 1 - across / kFold);
    const float inwards = across < kFold ? across - apart * std::min(1.0f, across / 0.001f)
                                         : (kFold - apart) * std::exp(-(across - kFold) / 0.010f);
    float* p = xyz->data() + 3 * (scene.membrane.first + node);
    p[1] -= std::copysign(share * inwards, from.y());
    p[2] += height + 0.0015f * share * std::exp(-across / 0.012f);
  }
}

Index NodeAt(const SceneView& scene, const Vec2f& material) {
  Index best = 0;
  for (Index k = 1; k < scene.membrane.node_count(); ++k) {
    const auto& all = scene.membrane_material;
    if ((all[k] - material).squaredNorm() < (all[best] - material).squaredNorm()) best = k;
  }
  return scene.membrane.first + best;
}

}  // namespace

ClippedMoment MakeClippedMoment(const SceneView& scene) {
  ClippedMoment clipped;
  clipped.moment = MakeSyntheticMoment(scene, 0.5);
  std::vector<float>& xyz = clipped.moment.tissue.xyz;
  Fold(scene, &xyz);
  const auto place = [&](Index k) { return Vec3f(xyz[3 * k], xyz[3 * k + 1], xyz[3 * k + 2]); };
  Eigen::Matrix3f axes;  // Legs on both sides of the fold, open downwards.
  axes.col(2) = -Vec3f::UnitZ();
  axes.col(0) = Vec3f::UnitY();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  for (const float side : {-1.0f, 1.0f}) {
    const Vec2f at = kPlace + Vec2f(side * kHalfDistance, 0);
    Clip clip;
    clip.length_m = kLength;
    clip.tool = kApplier;
    clip.anchors = {NodeAt(scene, at), NodeAt(scene, at - Vec2f(0, 0.0045f)),
                    NodeAt(scene, at + Vec2f(0.0015f, -0.002f))};
    const Vec3f crest = place(clip.anchors[0]);
    const ClipPose pose{crest + Vec3f(0, 0, 0.0012f - 0.5f * kLength), Quatf(axes)};
    const auto& [a, b, c] = clip.anchors;
    if (Place(pose, place(a), place(b), place(c), &clip)) clipped.clips.push_back(clip);
    if (side < 0) continue;
    // The applier, drawn back and turned a little about the vessel's direction.
    ToolSample& tool = clipped.moment.tools.tools[kApplier];
    tool.kind = ToolKind::kClipApplier;
    const Vec3f shaft = (crest + Vec3f(0, 0, 0.002f) - scene.tools[kApplier].p_WP).normalized();
    Eigen::Matrix3f turned;
    turned.col(2) = shaft;
    turned.col(0) = (Vec3f::UnitY() - shaft.y() * shaft).normalized();
    turned.col(1) = turned.col(2).cross(turned.col(0));
    tool.p_WT = crest - 0.008f * shaft;
    tool.q_WT = Quatf(turned);
    clipped.moment.handles.handles[kApplier].present = true;
    clipped.moment.handles.handles[kApplier].jaw_angle_rad = 0.5f;
  }
  clipped.between = kVessel;
  clipped.between_W = place(NodeAt(scene, kPlace));
  return clipped;
}

}  // namespace fulcrum::render
