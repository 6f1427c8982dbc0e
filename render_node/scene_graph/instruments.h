// The instruments: built once from the scene's tools (from meshes if the scene has them), posed by ToolState, with jaws
// opened by HandleState.
#pragma once

#include <array>
#include <memory>
#include <osg/Group>
#include <osg/MatrixTransform>
#include <string>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/outline.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// Tool of a node of this name in the graph of the instruments; -1: none.
[[nodiscard]] int ToolNamed(const std::string& name);

class Instruments {
 public:
  explicit Instruments(const SceneView& scene);

  /// Sets position and orientation in frame W; a tool of kind kNone is not drawn.
  void SetPose(int tool, const ToolSample& sample);
  void SetJaw(int tool, float angle_rad);
  /// Appends the edges of the instruments that are there (AppendOutline), as `eye` sees them in a picture of `size`
  /// [pixels].
  void AppendEdges(const Laparoscope& eye, const Vec2f& size, std::vector<EdgeLine>* lines) const;
  [[nodiscard]] osg::Group* node() const { return root_; }

 private:
  struct Instrument {
    osg::ref_ptr<osg::MatrixTransform> body;
    std::array<osg::ref_ptr<osg::MatrixTransform>, 2> jaws;  // They open towards +x and -x.
    // Transformation of a closed jaw from its own frame to frame T.
    std::array<osg::Matrix, 2> closed;
    float hinge_m = 0;
    std::shared_ptr<const MeshEdges> body_edges;
    std::array<std::shared_ptr<const MeshEdges>, 2> jaw_edges;
  };
  static void Build(const ToolDescription& tool, Instrument* instrument);
  static void BuildFromMeshes(const SceneView& scene, std::uint32_t tool, Instrument* instrument);

  osg::ref_ptr<osg::Group> root_;
  std::array<Instrument, kMaxTools> instruments_;
};

}  // namespace fulcrum::render
