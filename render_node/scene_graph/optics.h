// The way from the scene to the picture: the scene is drawn into a texture, as finely as the quality says, and the
// round field of it is put into the picture at full size. What stands still is drawn once, into a texture of its own,
// and copied with its depth beneath each new picture.
#pragma once

#include <osg/Camera>
#include <osg/Texture2D>

#include "render_node/geometry/laparoscope.h"

namespace fulcrum::render {

class Optics {
 public:
  /// Keeps both nodes. The textures have `width` x `height` pixels.
  Optics(const Laparoscope& scope, int width, int height, osg::Node* background, osg::Node* scene);

  /// Share of the width and height that the scene is drawn with, in (0, 1].
  void SetScale(float scale);
  void SetScope(const Laparoscope& scope);
  /// The scene is no longer as in its last picture.
  void SceneChanged();
  [[nodiscard]] osg::Group* node() const { return node_; }

 private:
  struct Target {
    osg::ref_ptr<osg::Texture2D> colour, depth;
    osg::ref_ptr<osg::Camera> camera;
  };
  class CopyTarget;
  Target MakeTarget(int order, osg::Node* content);
  void BackgroundChanged();
  void AddField();

  Laparoscope scope_;
  int width_;
  int height_;
  osg::ref_ptr<osg::Group> node_;
  osg::ref_ptr<osg::Uniform> circle_radius_, picture_centre_, texture_scale_, texture_most_;
  Target background_, scene_;
};

}  // namespace fulcrum::render
