#include "render_node/scene_graph/instruments.h"

#include <numbers>

#include "render_node/geometry/solid.h"
#include "render_node/scene_graph/mesh.h"
#include "render_node/scene_graph/program.h"

namespace fulcrum::render {
namespace {

osg::ref_ptr<osg::Geometry> ToGeometry(const Solid& solid, const char* name) {
  Mesh mesh(name, false);
  mesh.SetPositions(solid.positions);
  mesh.SetNormals(solid.normals);
  mesh.SetColours(solid.colours);
  mesh.SetTriangles(solid.triangles);
  return mesh.geometry();
}

}  // namespace

Instruments::Instruments(const SceneView& scene) : root_(new osg::Group) {
  root_->getOrCreateStateSet()->setAttributeAndModes(MakeProgram("surface.vert", "instrument.frag"));
  for (std::size_t k = 0; k < instruments_.size(); ++k) {
    const ToolDescription& tool = scene.tools[k];
    Instrument& instrument = instruments_[k];
    instrument.body = new osg::MatrixTransform;
    instrument.body->setNodeMask(0);
    instrument.hinge_m = tool.tip_length_m;
    root_->addChild(instrument.body);
    const ToolShape shape{tool.shaft_radius_m, tool.shaft_length_m, tool.tip_radius_m, tool.tip_length_m};
    if (tool.kind == ToolKind::kHook) {
      instrument.body->addChild(ToGeometry(Hook(shape), "hook"));
    } else if (tool.kind != ToolKind::kNone) {
      instrument.body->addChild(ToGeometry(GrasperShaft(shape), "grasper"));
      const osg::ref_ptr<osg::Geometry> jaw = tool.kind == ToolKind::kScissors
                                                  ? ToGeometry(ScissorBlade(shape), "blade")
                                                  : ToGeometry(GrasperJaw(shape), "jaw");
      for (auto& joint : instrument.jaws) {
        joint = new osg::MatrixTransform;
        joint->addChild(jaw);
        instrument.body->addChild(joint);
      }
      SetJaw(static_cast<int>(k), 0);
    }
  }
}

void Instruments::SetPose(int tool, const ToolSample& sample) {
  Instrument& instrument = instruments_[static_cast<std::size_t>(tool)];
  instrument.body->setNodeMask(sample.kind == ToolKind::kNone ? 0u : ~0u);
  const Quatf& q = sample.q_WT;
  const Vec3f& p = sample.p_WT;
  instrument.body->setMatrix(osg::Matrix::rotate(osg::Quat(q.x(), q.y(), q.z(), q.w())) *
                             osg::Matrix::translate(p.x(), p.y(), p.z()));
}

void Instruments::SetJaw(int tool, float angle_rad) {
  const Instrument& instrument = instruments_[static_cast<std::size_t>(tool)];
  if (!instrument.jaws[0]) {
    return;
  }
  const osg::Vec3 y(0, 1, 0), z(0, 0, 1);
  const osg::Matrix to_hinge = osg::Matrix::translate(0, 0, -instrument.hinge_m);
  instrument.jaws[0]->setMatrix(osg::Matrix::rotate(0.5 * angle_rad, y) * to_hinge);
  instrument.jaws[1]->setMatrix(osg::Matrix::rotate(std::numbers::pi, z) * osg::Matrix::rotate(-0.5 * angle_rad, y) *
                                to_hinge);
}

}  // namespace fulcrum::render
