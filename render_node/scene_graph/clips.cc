#include "render_node/scene_graph/clips.h"

#include <algorithm>
#include <utility>

#include "render_node/geometry/solid.h"
#include "render_node/scene_graph/mesh.h"
#include "services/base/core/clips.h"

namespace fulcrum::render {

void Clips::Set(std::span<const Clip> clips) {
  root_->removeChildren(0, root_->getNumChildren());
  const std::vector<Placed> before = std::exchange(clips_, {});
  for (const Clip& clip : clips) {
    const Solid solid = TitaniumClip(clip.length_m);
    Mesh mesh("clip", false);
    mesh.SetPositions(solid.positions);
    mesh.SetNormals(solid.normals);
    mesh.SetColours(solid.colours);
    mesh.SetTriangles(solid.triangles);
    Placed& placed = clips_.emplace_back();
    placed.clip = clip;
    placed.body = new osg::MatrixTransform;
    placed.edges = std::make_shared<MeshEdges>(solid.positions, solid.triangles);
    // A clip that was there holds what it held.
    const auto known = std::ranges::find_if(
        before, [&](const Placed& old) { return old.clip.anchors == clip.anchors && old.clip.p_AC == clip.p_AC; });
    if (known != before.end()) {
      placed.footprint = known->footprint;
      placed.footprint_known = known->footprint_known;
    }
    placed.body->setNodeMask(0);
    placed.body->addChild(mesh.geometry());
    root_->addChild(placed.body);
  }
}

bool Clips::Follow(std::span<const float> xyz, bool seen) {
  const auto at = [&](std::uint32_t k) { return Vec3f(xyz[3 * k], xyz[3 * k + 1], xyz[3 * k + 2]); };
  for (Placed& placed : clips_) {
    const auto& [a, b, c] = placed.clip.anchors;
    const std::optional<ClipPose> pose = PoseOf(placed.clip, at(a), at(b), at(c));
    if (!pose) continue;
    const Quatf& q = pose->q_WC;
    const Vec3f& p = pose->p_WC;
    placed.to_world.topLeftCorner<3, 3>() = q.toRotationMatrix();
    placed.to_world.topRightCorner<3, 1>() = p;
    placed.body->setMatrix(osg::Matrix::rotate(osg::Quat(q.x(), q.y(), q.z(), q.w())) *
                           osg::Matrix::translate(p.x(), p.y(), p.z()));
    placed.body->setNodeMask(~0u);
    if (!seen || placed.footprint_known) continue;
    placed.footprint = FootprintOf(placed.clip, *pose, scene_, xyz);
    placed.footprint_known = true;
  }
  std::vector<ClipFootprint> now;
  for (const Placed& placed : clips_) {
    if (placed.footprint) now.push_back(*placed.footprint);
  }
  const bool changed = now != footprints_;
  footprints_ = std::move(now);
  return changed;
}

void Clips::AppendEdges(const Laparoscope& eye, const Vec2f& size, std::vector<EdgeLine>* lines) const {
  for (const Placed& placed : clips_) {
    if (placed.body->getNodeMask() == 0) continue;
    AppendOutline(*placed.edges, eye.view * placed.to_world, eye.projection, size, lines);
  }
}

}  // namespace fulcrum::render
