// The instruments: built once from the scene's tools, posed by ToolState and opened by HandleState.
#pragma once

#include <array>
#include <osg/Group>
#include <osg/MatrixTransform>

#include "services/core/scene_view.h"

namespace fulcrum::render {

class Instruments {
 public:
  explicit Instruments(const SceneView& scene);

  /// Tip and attitude in frame W; a tool of kind kNone is not drawn.
  void SetPose(int tool, const ToolSample& sample);
  void SetJaw(int tool, float angle_rad);
  [[nodiscard]] osg::Group* node() const { return root_; }

 private:
  struct Instrument {
    osg::ref_ptr<osg::MatrixTransform> body;
    std::array<osg::ref_ptr<osg::MatrixTransform>, 2> jaws;
    float hinge_m = 0;
  };
  osg::ref_ptr<osg::Group> root_;
  std::array<Instrument, kMaxTools> instruments_;
};

}  // namespace fulcrum::render
