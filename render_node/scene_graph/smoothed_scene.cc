#include "render_node/scene_graph/smoothed_scene.h"

#include "render_node/offscreen/framebuffer.h"

namespace fulcrum::render {

void SmoothedScene::SetSize(int width, int height, int scene_width, int scene_height) {
  filter_.SetSize(width, height, scene_width, scene_height);
  width_ = width;
  height_ = height;
  scene_width_ = scene_width;
  scene_height_ = scene_height;
  Changed();
}

Laparoscope SmoothedScene::Jittered(const Laparoscope& eye) {
  seen_ = eye.projection * eye.view;
  if (moves()) return eye;
  const Vec2f jitter = filter_.jitter();
  Laparoscope jittered = eye;
  // Clip coordinates are divided by the depth -z.
  jittered.projection(0, 2) -= 2 * jitter.x() / static_cast<float>(scene_width_);
  jittered.projection(1, 2) -= 2 * jitter.y() / static_cast<float>(scene_height_);
  return jittered;
}

void SmoothedScene::Add(unsigned unit, osg::State* state) {
  if (moves()) {
    filter_.Forget();
    drawn_ = seen_;
    return;
  }
  const unsigned context = state->getContextID();
  ReadTexture(scene_->getTextureObject(context)->id(), scene_width_, scene_height_, filter_.picture().data());
  ++still_pictures_;
  filter_.Add(still_pictures_ == filter_.period());
  if (result_->getTextureObject(context) == nullptr) {
    state->setActiveTextureUnit(unit);
    result_->apply(*state);
    state->haveAppliedTextureAttribute(unit, result_);
  }
  WriteTexture(result_->getTextureObject(context)->id(), width_, height_, filter_.shown().data());
}

}  // namespace fulcrum::render
