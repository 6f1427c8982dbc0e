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

std::shared_ptr<const MeshEdges> EdgesOf(const Solid& solid) {
  return std::make_shared<MeshEdges>(solid.positions, solid.triangles);
}

Eigen::Matrix4f FromOsg(const osg::Matrix& m) {
  Eigen::Matrix4f out;
  for (int row = 0; row < 4; ++row) {
    for (int col = 0; col < 4; ++col) out(row, col) = static_cast<float>(m(col, row));  // OSG multiplies row vectors.
  }
  return out;
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
  const auto set_body = [instrument](const Solid& solid, const char* name) {
    instrument->body->addChild(ToGeometry(solid, name));
    instrument->body_edges = EdgesOf(solid);
  };
  if (tool.kind == ToolKind::kHook) return set_body(Hook(shape), "hook");
  if (tool.kind == ToolKind::kSuction) return set_body(SuctionTube(shape), "tube");
  const bool scissors = tool.kind == ToolKind::kScissors, applier = tool.kind == ToolKind::kClipApplier;
  set_body(applier ? ClipApplierShaft(shape) : GrasperShaft(shape), "grasper");
  const Solid half = applier ? ClipApplierJaw(shape) : scissors ? ScissorBlade(shape) : GrasperJaw(shape);
  const osg::ref_ptr<osg::Geometry> jaw = ToGeometry(half, scissors ? "blade" : "jaw");
  instrument->jaw_edges.fill(EdgesOf(half));
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
    const Solid solid = InstrumentSolid(scene, mesh);
    const auto geometry = ToGeometry(solid, "instrument");
    if (mesh.part == ToolPart::kBody) {
      instrument->body->addChild(geometry);
      instrument->body_edges = EdgesOf(solid);
      continue;
    }
    const std::size_t side = mesh.part == ToolPart::kJawPlus ? 0 : 1;
    instrument->jaw_edges.at(side) = EdgesOf(solid);
    auto& joint = instrument->jaws.at(side);
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

void Instruments::AppendEdges(const Laparoscope& eye, const Vec2f& size, std::vector<EdgeLine>* lines) const {
  for (const Instrument& instrument : instruments_) {
    if (instrument.body->getNodeMask() == 0) continue;
    const Eigen::Matrix4f to_camera = eye.view * FromOsg(instrument.body->getMatrix());
    if (instrument.body_edges) AppendOutline(*instrument.body_edges, to_camera, eye.projection, size, lines);
    for (std::size_t k = 0; k < 2; ++k) {
      if (!instrument.jaw_edges.at(k)) continue;
      const Eigen::Matrix4f jaw = FromOsg(instrument.jaws.at(k)->getMatrix());
      AppendOutline(*instrument.jaw_edges.at(k), to_camera * jaw, eye.projection, size, lines);
    }
  }
}

}  // namespace fulcrum::render
