#include "render_node/scene_graph/instruments.h"

#include <algorithm>
#include <numbers>

#include "render_node/geometry/instrument_mesh.h"
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

constexpr const char* kToolName = "tool ";

}  // namespace

int ToolNamed(const std::string& name) {
  const std::size_t digit = std::string(kToolName).size();
  return name.starts_with(kToolName) && name.size() > digit ? name[digit] - '0' : -1;
}

Instruments::Instruments(const SceneView& scene) : root_(new osg::Group) {
  root_->getOrCreateStateSet()->setAttributeAndModes(MakeProgram("surface.vert", "instrument.frag"));
  for (std::uint32_t k = 0; k < kMaxTools; ++k) {
    Instrument& instrument = instruments_[k];
    instrument.body = new osg::MatrixTransform;
    instrument.body->setName(kToolName + std::to_string(k));
    instrument.body->setNodeMask(0);
    instrument.hinge_m = scene.tools[k].tip_length_m;
    root_->addChild(instrument.body);
    if (std::any_of(scene.tool_meshes.begin(), scene.tool_meshes.end(), [k](const auto& m) { return m.tool == k; })) {
      BuildFromMeshes(scene, k, &instrument);
    } else if (TouchesTissue(scene.tools[k].kind)) {  // The picture is the scope's own.
      Build(scene.tools[k], &instrument);
    }
    SetJaw(static_cast<int>(k), 0);
  }
}

void Instruments::Build(const ToolDescription& tool, Instrument* instrument) {
  const ToolShape shape{tool.shaft_radius_m, tool.shaft_length_m, tool.tip_radius_m, tool.tip_length_m};
  if (tool.kind == ToolKind::kHook) {
    instrument->body->addChild(ToGeometry(Hook(shape), "hook"));
    return;
  }
  if (tool.kind == ToolKind::kSuction) {
    instrument->body->addChild(ToGeometry(SuctionTube(shape), "tube"));
    return;
  }
  instrument->body->addChild(ToGeometry(GrasperShaft(shape), "grasper"));
  const osg::ref_ptr<osg::Geometry> jaw = tool.kind == ToolKind::kScissors ? ToGeometry(ScissorBlade(shape), "blade")
                                                                           : ToGeometry(GrasperJaw(shape), "jaw");
  const osg::Matrix to_hinge = osg::Matrix::translate(0, 0, -tool.tip_length_m);
  instrument->closed = {to_hinge, osg::Matrix::rotate(std::numbers::pi, osg::Vec3(0, 0, 1)) * to_hinge};
  for (auto& joint : instrument->jaws) {
    joint = new osg::MatrixTransform;
    joint->addChild(jaw);
    instrument->body->addChild(joint);
  }
}

void Instruments::BuildFromMeshes(const SceneView& scene, std::uint32_t tool, Instrument* instrument) {
  for (const ToolMesh& mesh : scene.tool_meshes) {
    if (mesh.tool != tool) {
      continue;
    }
    const auto geometry = ToGeometry(InstrumentSolid(scene, mesh), "instrument");
    if (mesh.part == ToolPart::kBody) {
      instrument->body->addChild(geometry);
      continue;
    }
    auto& joint = instrument->jaws[mesh.part == ToolPart::kJawPlus ? 0 : 1];
    joint = new osg::MatrixTransform;
    joint->addChild(geometry);
    instrument->body->addChild(joint);
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
  const osg::Matrix from_hinge = osg::Matrix::translate(0, 0, -instrument.hinge_m);
  for (std::size_t k = 0; k < 2; ++k) {
    if (instrument.jaws[k]) {
      const double turn = (k == 0 ? 0.5 : -0.5) * angle_rad;
      instrument.jaws[k]->setMatrix(instrument.closed[k] * osg::Matrix::inverse(from_hinge) *
                                    osg::Matrix::rotate(turn, osg::Vec3(0, 1, 0)) * from_hinge);
    }
  }
}

}  // namespace fulcrum::render
