// Drawing of the scene into the picture: the scene is drawn into a texture at the resolution of the quality setting,
// and its round field is scaled into the picture. The static background is drawn once for a place of the camera,
// into a texture of its own, and copied with its depth before each picture of the scene. With stereo each eye has its
// own textures, half as wide or high as the picture, and its field fills its half of the picture; the meshes are the
// same.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <osg/Camera>
#include <osg/Geode>
#include <osg/Program>
#include <osg/Texture2D>
#include <span>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "render_node/scene_graph/edge_lines.h"
#include "render_node/scene_graph/smoothed_scene.h"

namespace fulcrum::render {

class Optics {
 public:
  /// Keeps both nodes. @param eyes of MakeEyes(), for the picture of `width` x `height` pixels.
  Optics(StereoLayout layout, std::span<const Laparoscope> eyes, int width, int height, osg::Node* background,
         osg::Node* scene);

  /// Replaces the textures by those of another size. `eyes` are those of the new picture.
  void SetSize(std::span<const Laparoscope> eyes, int width, int height);
  /// Resolution of the scene as a share of width and height, in (0, most].
  void SetScale(float scale);
  /// Largest scale, 1 at first: the textures have as many pixels.
  void SetMostScale(float most);
  /// Smooths edges with the last pictures of the scene (smoothed_scene.h); for a software rasteriser, scales up to 1.
  void SetSmoothed(bool on);
  /// Appends the edges that an eye sees in a picture of so many pixels.
  using FindEdges = std::function<void(const Laparoscope& eye, const Vec2f& size, std::vector<EdgeLine>* lines)>;
  /// Smooths edges of known place in each picture (edge_lines.h) of scales up to 1; empty: not.
  void SetEdges(FindEdges find);
  /// Finds these edges again if the scene has changed; before a picture.
  void UpdateEdges();
  /// Draws the scene again, at other places within its pixels, while that still makes the mean of its pictures better.
  /// Returns false, and does nothing, if it would not, or if it is not smoothed.
  bool Refine();
  /// An eye that rests draws a background of a new place within its pixels in the next picture: so is that of each
  /// place, once.
  [[nodiscard]] bool DrawsBackgroundAtRest() const;
  /// Moves the cameras; the size of the picture does not change. The backgrounds of the last two places are kept, for
  /// pictures of two cameras in turn.
  void SetEyes(std::span<const Laparoscope> eyes);
  /// 0: clear lens … 1: nothing to be seen (services/base/core/lens.h).
  void SetSoil(float soil);
  /// Share of the light that smoke scatters: 0 none.
  void SetHaze(float haze) { haze_->set(haze); }
  /// Factor on the light that the camera gets.
  void SetLight(const Vec3f& light);
  /// Must be called when the scene has changed since its last picture.
  void SceneChanged();
  /// The same where what SetEdges finds has changed as well.
  void EdgesChanged();
  [[nodiscard]] osg::Group* node() const { return node_; }

 private:
  struct Target {
    osg::ref_ptr<osg::Texture2D> colour, depth;
    osg::ref_ptr<osg::Camera> camera;
  };
  struct Background {
    Target target;
    osg::ref_ptr<osg::Geode> copy;    // Into the scene.
    std::optional<Laparoscope> from;  // Empty: holds no picture, and will hold none after the next.
  };
  /// What an eye sees, and its part of the picture.
  struct Eye {
    /// Draws the scene in the next picture.
    void Draw();
    /// Looks from `seen`, or a place within a pixel of it. Draws its background, unless that is among those kept.
    void Look();

    Laparoscope seen;
    std::vector<Background> backgrounds;
    std::size_t used = 0;  // Of them.
    std::size_t kept = 2;  // So many of them hold pictures.
    int order = 0;         // Of drawing.
    Target scene;
    std::shared_ptr<SmoothedScene> smoothed;  // Null: not.
    osg::ref_ptr<osg::Texture2D> mean;        // Of smoothed.
    bool shows_mean = false;
    osg::ref_ptr<osg::Uniform> light_position;
    osg::ref_ptr<osg::StateSet> field;
    osg::ref_ptr<osg::Geode> edges;
    std::shared_ptr<EdgeLines> edge_lines;
  };
  class CopyTarget;
  Target MakeTarget(int order, osg::Node* content);
  void AddEye(osg::Node* scene);
  [[nodiscard]] bool smoothed() const { return !eyes_.empty() && eyes_.front().smoothed != nullptr; }
  void KeepBackgrounds(std::size_t count, Eye* eye);
  void BackgroundsChanged();
  void AddField(Eye* eye);
  void UseScale();
  void UseLens();
  void ResizeTextures();
  /// Of the scene, and of its textures, across or up, where the picture has `full`.
  [[nodiscard]] int Pixels(int full) const;
  [[nodiscard]] int Texels(int full) const;
  [[nodiscard]] static int Texels(int full, float scale);

  StereoLayout layout_;
  int width_ = 1, height_ = 1;                          // Of an eye's part of the picture [pixels].
  Vec2f circle_radius_, picture_centre_, half_height_;  // In such pixels across and up.
  float scale_ = 1, most_ = 1;
  osg::ref_ptr<osg::Group> node_;
  osg::ref_ptr<osg::Node> background_;
  osg::ref_ptr<osg::Uniform> radius_, centre_, half_, texture_scale_, texture_most_, pixel_, soil_, haze_, smoke_,
      eye_pixels_, reach_;
  osg::ref_ptr<osg::Program> clear_lens_, smooth_lens_, soiled_lens_;
  std::vector<Eye> eyes_;
  FindEdges find_edges_;
  bool edges_changed_ = false;
  std::vector<EdgeLine> lines_;  // Scratch.
};

}  // namespace fulcrum::render
