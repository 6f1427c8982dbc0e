// Drawing of the scene into the picture: the scene is drawn into a texture at the resolution of the quality setting,
// and its round field is scaled into the picture. The static background is drawn once for a place of the camera, into a
// texture of its own, and copied with its depth before each picture of the scene.
#pragma once

#include <array>
#include <optional>
#include <osg/Camera>
#include <osg/Geode>
#include <osg/Program>
#include <osg/Texture2D>

#include "render_node/geometry/laparoscope.h"

namespace fulcrum::render {

class Optics {
 public:
  /// Keeps both nodes. The textures have `width` x `height` pixels.
  Optics(const Laparoscope& scope, int width, int height, osg::Node* background, osg::Node* scene);

  /// Replaces the textures by those of another size. `scope` is that of the new picture.
  void SetSize(const Laparoscope& scope, int width, int height);
  /// Resolution of the scene as a share of width and height, in (0, most].
  void SetScale(float scale);
  /// Largest scale, 1 at first: the textures have as many pixels.
  void SetMostScale(float most);
  /// Moves the camera; the size of the picture does not change. The backgrounds of the last two places are kept, for
  /// pictures of two cameras in turn.
  void SetScope(const Laparoscope& scope);
  /// 0: clear lens … 1: nothing to be seen (services/base/core/lens.h).
  void SetSoil(float soil);
  /// Share of the light that smoke scatters: 0 none.
  void SetHaze(float haze) { haze_->set(haze); }
  /// Factor on the light that the camera gets.
  void SetLight(const Vec3f& light);
  /// Must be called when the scene has changed since its last picture.
  void SceneChanged();
  [[nodiscard]] osg::Group* node() const { return node_; }

 private:
  struct Target {
    osg::ref_ptr<osg::Texture2D> colour, depth;
    osg::ref_ptr<osg::Camera> camera;
  };
  struct Background {
    Target target;
    osg::ref_ptr<osg::Geode> copy;    // Into the scene.
    std::optional<Laparoscope> from;  // None: nothing has been drawn, nor will be in the next picture.
  };
  class CopyTarget;
  Target MakeTarget(int order, osg::Node* content);
  void BackgroundsChanged();
  void Use(std::size_t background);
  void AddField();
  void UseScale();
  void UseLens();
  void ResizeTextures();
  [[nodiscard]] int Texels(int pixels) const;

  Laparoscope scope_;
  int width_;
  int height_;
  float scale_ = 1, most_ = 1;
  osg::ref_ptr<osg::Group> node_;
  osg::ref_ptr<osg::Uniform> circle_radius_, picture_centre_, texture_scale_, texture_most_, pixel_, soil_, haze_,
      smoke_;
  osg::ref_ptr<osg::Program> clear_lens_, smooth_lens_, soiled_lens_;
  osg::ref_ptr<osg::StateSet> field_state_;
  std::array<Background, 2> backgrounds_;
  std::size_t used_ = 0;  // Of them.
  Target scene_;
};

}  // namespace fulcrum::render
