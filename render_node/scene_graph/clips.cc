#include "render_node/scene_graph/clips.h"

#include "render_node/geometry/solid.h"
#include "render_node/scene_graph/mesh.h"
#include "services/base/core/clips.h"

namespace fulcrum::render {

void Clips::Set(std::span<const Clip> clips) {
  root_->removeChildren(0, root_->getNumChildren());
  clips_.clear();
  for (const Clip& clip : clips) {
    const Solid solid = TitaniumClip(clip.length_m);
    Mesh mesh("clip", false);
    mesh.SetPositions(solid.positions);
    mesh.SetNormals(solid.normals);
    mesh.SetColours(solid.colours);
    mesh.SetTriangles(solid.triangles);
    Placed placed{clip, new osg::MatrixTransform, std::make_shared<MeshEdges>(solid.positions, solid.triangles)};
    placed.body->setNodeMask(0);
    placed.body->addChild(mesh.geometry());
    root_->addChild(placed.body);
    clips_.push_back(std::move(placed));
  }
}

void Clips::Follow(std::span<const float> xyz) {
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
  }
}

void Clips::AppendEdges(const Laparoscope& eye, const Vec2f& size, std::vector<EdgeLine>* lines) const {
  for (const Placed& placed : clips_) {
    if (placed.body->getNodeMask() == 0) continue;
    AppendOutline(*placed.edges, eye.view * placed.to_world, eye.projection, size, lines);
  }
}

}  // namespace fulcrum::render
