// Anti-aliasing of what a software rasteriser has drawn: reads each picture of the scene, adds it to the last ones
// (geometry/temporal_filter.h) and gives the result as a texture. Its textures are memory, so reading and writing them
// are copies of a tenth of a millisecond.
#pragma once

#include <osg/Camera>
#include <osg/Texture2D>

#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/temporal_filter.h"

namespace fulcrum::render {

class SmoothedScene {
 public:
  /// Keeps the textures: that of the scene's picture, and that of the result.
  SmoothedScene(osg::Texture2D* scene, osg::Texture2D* result) : scene_(scene), result_(result) {}

  /// Size of the result, and of the scene's picture [pixels].
  void SetSize(int width, int height, int scene_width, int scene_height);
  /// Something has changed since the last picture.
  void Changed() { still_pictures_ = 0; }
  /// `eye` for the next picture: shifted by less than a pixel while the camera rests.
  [[nodiscard]] Laparoscope Jittered(const Laparoscope& eye);
  /// The camera is not where it was at the last picture: the next one is shown as it is, without result.
  [[nodiscard]] bool moves() const { return seen_ != drawn_; }
  /// Adds the picture that has just been drawn as Jittered() said. The OpenGL context must be current. `unit` is that
  /// of the result's texture.
  void Add(unsigned unit, osg::State* state);
  /// Number of places within a pixel.
  [[nodiscard]] int period() const { return filter_.period(); }
  /// Another picture of the same state would still change the result.
  [[nodiscard]] bool improves() const { return still_pictures_ < filter_.period(); }

 private:
  osg::ref_ptr<osg::Texture2D> scene_, result_;
  TemporalFilter filter_;
  int width_ = 0, height_ = 0, scene_width_ = 0, scene_height_ = 0;
  int still_pictures_ = 0;                                                            // Added since the last change.
  Eigen::Matrix4f seen_ = Eigen::Matrix4f::Zero(), drawn_ = Eigen::Matrix4f::Zero();  // Frame W to clip coordinates.
};

}  // namespace fulcrum::render
