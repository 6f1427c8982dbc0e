// The clips on the tissue: small rigid meshes that follow their anchors. They are made when they come: a session
// without clips pays nothing.
#pragma once

#include <memory>
#include <optional>
#include <osg/Group>
#include <osg/MatrixTransform>
#include <span>
#include <vector>

#include "render_node/geometry/clip_footprint.h"
#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/outline.h"
#include "services/base/core/messages.h"

namespace fulcrum::render {

class Clips {
 public:
  /// Keeps a reference to the arrays of `scene`.
  explicit Clips(const SceneView& scene) : scene_(scene) {}
  /// Replaces the clips. @pre anchors are particles of Follow().
  void Set(std::span<const Clip> clips);
  /// Places them on the particles, 3 floats each [m, W]. One whose anchors are in one line stays where it was, and is
  /// not drawn before it has had a place. @param seen these are places of a TissueFrame, not those at rest. Returns
  /// true if the footprints have changed.
  bool Follow(std::span<const float> xyz, bool seen);
  [[nodiscard]] bool empty() const { return clips_.empty(); }
  /// Where they hold sheets, found once for each clip: on the particles of the first Follow() whose `seen` is true.
  [[nodiscard]] std::span<const ClipFootprint> footprints() const { return footprints_; }
  /// Appends their edges (AppendOutline), as `eye` sees them in a picture of `size` [pixels].
  void AppendEdges(const Laparoscope& eye, const Vec2f& size, std::vector<EdgeLine>* lines) const;
  /// To be drawn by the shader of the instruments. Each clip is a geometry "clip".
  [[nodiscard]] osg::Group* node() const { return root_; }

 private:
  struct Placed {
    Clip clip;
    osg::ref_ptr<osg::MatrixTransform> body;
    std::shared_ptr<const MeshEdges> edges;
    Eigen::Matrix4f to_world = Eigen::Matrix4f::Identity();
    std::optional<ClipFootprint> footprint;
    bool footprint_known = false;
  };

  SceneView scene_;

  osg::ref_ptr<osg::Group> root_ = new osg::Group;
  std::vector<Placed> clips_;
  std::vector<ClipFootprint> footprints_;
};

}  // namespace fulcrum::render
