#include "render_node/scene_graph/optics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "render_node/offscreen/framebuffer.h"
#include "render_node/scene_graph/mesh.h"
#include "render_node/scene_graph/order.h"
#include "render_node/scene_graph/program.h"

namespace fulcrum::render {
namespace {

constexpr unsigned kPictureUnit = 6, kDepthUnit = 9;  // Texture units that no other shader uses.
constexpr Index kSides = 128;

osg::Matrix ToOsg(const Eigen::Matrix4f& m) {
  osg::Matrix out;
  for (int row = 0; row < 4; ++row) {
    for (int col = 0; col < 4; ++col) {
      out(row, col) = m(col, row);  // OSG multiplies row vectors.
    }
  }
  return out;
}

void LookFrom(const Laparoscope& eye, osg::Camera* camera) {
  camera->setViewMatrix(ToOsg(eye.view));
  camera->setProjectionMatrix(ToOsg(eye.projection));
}

/// Disables its camera after a picture, until something has changed, and adds the picture to the mean of the last ones.
class DrawnOnce : public osg::Camera::DrawCallback {
 public:
  explicit DrawnOnce(osg::Camera* camera, std::shared_ptr<SmoothedScene> smoothed = nullptr)
      : camera_(camera), smoothed_(std::move(smoothed)) {}
  void operator()(osg::RenderInfo& info) const override {
    camera_->setNodeMask(0);
    if (smoothed_) smoothed_->Add(kPictureUnit, info.getState());
  }

 private:
  osg::Camera* camera_;  // Owns this.
  std::shared_ptr<SmoothedScene> smoothed_;
};

osg::ref_ptr<osg::Texture2D> MakeRenderTexture(GLint internal, GLenum format, GLenum type) {
  osg::ref_ptr<osg::Texture2D> texture = new osg::Texture2D;
  texture->setInternalFormat(internal);
  texture->setSourceFormat(format);
  texture->setSourceType(type);
  texture->setFilter(osg::Texture::MIN_FILTER, osg::Texture::LINEAR);
  texture->setFilter(osg::Texture::MAG_FILTER, osg::Texture::LINEAR);
  texture->setWrap(osg::Texture::WRAP_S, osg::Texture::CLAMP_TO_EDGE);
  texture->setWrap(osg::Texture::WRAP_T, osg::Texture::CLAMP_TO_EDGE);
  texture->setResizeNonPowerOfTwoHint(false);
  return texture;
}
osg::ref_ptr<osg::Texture2D> MakeColour() { return MakeRenderTexture(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE); }

}  // namespace

/// Copies the background, colour and depth, before the scene is drawn.
class Optics::CopyTarget : public osg::Drawable {
 public:
  CopyTarget(const Target& from, const Target& to)
      : from_{from.colour, from.depth}, to_{to.colour, to.depth}, camera_(to.camera) {
    setUseDisplayList(false);
    setCullingActive(false);
    DrawIn(Order::kBackground, getOrCreateStateSet());
  }
  CopyTarget() = default;
  CopyTarget(const CopyTarget& other, const osg::CopyOp& copy_op)
      : osg::Drawable(other, copy_op), from_(other.from_), to_(other.to_), camera_(other.camera_) {}
  META_Object(fulcrum, CopyTarget);

  void drawImplementation(osg::RenderInfo& info) const override {
    const osg::Viewport* area = camera_->getViewport();
    const unsigned context = info.getContextID();
    for (std::size_t k = 0; k < from_.size(); ++k) {
      CopyTexture(from_[k]->getTextureObject(context)->id(), to_[k]->getTextureObject(context)->id(),
                  static_cast<int>(area->width()), static_cast<int>(area->height()));
    }
  }

 private:
  std::array<osg::ref_ptr<osg::Texture2D>, 2> from_, to_;  // Colour, depth.
  const osg::Camera* camera_ = nullptr;                    // Owns this: a reference would keep both for good.
};

Optics::Optics(StereoLayout layout, std::span<const Laparoscope> eyes, int width, int height, osg::Node* background,
               osg::Node* scene)
    : layout_(layout),
      node_(new osg::Group),
      background_(background),
      radius_(new osg::Uniform("circle_radius", osg::Vec2())),
      centre_(new osg::Uniform("picture_centre", osg::Vec2())),
      half_(new osg::Uniform("half_height", osg::Vec2())),
      texture_scale_(new osg::Uniform("texture_scale", osg::Vec2(1, 1))),
      texture_most_(new osg::Uniform("texture_most", osg::Vec2(1, 1))),
      pixel_(new osg::Uniform("pixel", osg::Vec2())),
      soil_(new osg::Uniform("soil", 0.0f)),
      haze_(new osg::Uniform("haze", 0.0f)),
      smoke_(new osg::Uniform("smoke", osg::Vec3())),
      eye_pixels_(new osg::Uniform("eye_pixels", osg::Vec2())),
      reach_(new osg::Uniform("reach", 1.0f)),
      clear_lens_(MakeProgram("field.vert", "field.frag")),
      smooth_lens_(MakeProgram("field.vert", "smooth.frag")),
      soiled_lens_(MakeProgram("field.vert", "soiled.frag")) {
  osg::StateSet* state = node_->getOrCreateStateSet();
  for (osg::Uniform* uniform : {radius_.get(), centre_.get(), half_.get()}) state->addUniform(uniform);
  for (std::size_t k = 0; k < eyes.size(); ++k) AddEye(scene);
  SetLight(Vec3f::Ones());
  SetEyes(eyes);
  SetSize(eyes, width, height);
}

void Optics::AddEye(osg::Node* scene) {
  Eye eye;
  eye.order = 2 * static_cast<int>(eyes_.size());
  eye.light_position = new osg::Uniform("light_position", osg::Vec3());
  eye.scene = MakeTarget(eye.order + 1, scene);
  eye.scene.camera->setClearMask(0);
  eye.scene.camera->getOrCreateStateSet()->addUniform(eye.light_position);
  KeepBackgrounds(2, &eye);
  AddField(&eye);
  eyes_.push_back(eye);
}

void Optics::KeepBackgrounds(std::size_t count, Eye* eye) {
  while (eye->backgrounds.size() < count) {
    Background& each = eye->backgrounds.emplace_back();
    each.target = MakeTarget(eye->order, background_);
    each.target.camera->setNodeMask(0);
    each.target.camera->setClearColor(osg::Vec4(0.12f, 0.035f, 0.03f, 1));
    each.target.camera->getOrCreateStateSet()->addUniform(eye->light_position);
    each.copy = new osg::Geode;
    each.copy->setNodeMask(0);
    each.copy->addDrawable(new CopyTarget(each.target, eye->scene));
    eye->scene.camera->addChild(each.copy);
  }
}

void Optics::SetSize(std::span<const Laparoscope> eyes, int width, int height) {
  width_ = layout_ == StereoLayout::kSideBySide ? std::max(1, width / 2) : width;
  height_ = layout_ == StereoLayout::kTopBottom ? std::max(1, height / 2) : height;
  const Vec2f squeeze(static_cast<float>(width_) / static_cast<float>(width),
                      static_cast<float>(height_) / static_cast<float>(height));
  circle_radius_ = eyes.front().circle_radius * squeeze;
  picture_centre_ = eyes.front().picture_centre.cwiseProduct(squeeze);
  half_height_ = eyes.front().picture_centre.y() * squeeze;
  for (std::size_t k = 0; k < eyes_.size(); ++k) eyes_[k].seen = eyes[k];
  ResizeTextures();
}

void Optics::SetMostScale(float most) {
  if (most == most_) return;
  most_ = most;
  ResizeTextures();
}

void Optics::SetSmoothed(bool on) {
  if (on == smoothed()) return;
  for (Eye& eye : eyes_) {
    eye.smoothed = nullptr;
    eye.mean = nullptr;
    if (on) {
      eye.mean = MakeColour();
      eye.smoothed = std::make_shared<SmoothedScene>(eye.scene.colour, eye.mean);
    }
    eye.scene.camera->setFinalDrawCallback(new DrawnOnce(eye.scene.camera, eye.smoothed));
  }
  ResizeTextures();
}

int Optics::Pixels(int full) const {
  return std::clamp(static_cast<int>(std::lround(scale_ * static_cast<float>(full))), 1, Texels(full, most_));
}

// Backgrounds of many places within a pixel must not take more memory than they need.
int Optics::Texels(int full) const { return Texels(full, smoothed() ? std::min(scale_, most_) : most_); }

int Optics::Texels(int full, float scale) {
  return std::max(1, static_cast<int>(std::lround(scale * static_cast<float>(full))));
}

void Optics::ResizeTextures() {
  const auto resize = [this](const Target& target) {
    for (osg::Texture2D* texture : {target.colour.get(), target.depth.get()}) {
      texture->setTextureSize(Texels(width_), Texels(height_));
      texture->dirtyTextureObject();
    }
    // Without this OpenSceneGraph keeps the framebuffer of the previous textures.
    target.camera->dirtyAttachmentMap();
  };
  for (Eye& eye : eyes_) {
    eye.kept = 2;
    if (eye.smoothed) {
      eye.smoothed->SetSize(width_, height_, Pixels(width_), Pixels(height_));
      eye.mean->setTextureSize(width_, height_);
      eye.mean->dirtyTextureObject();
      eye.kept = static_cast<std::size_t>(eye.smoothed->period());
      KeepBackgrounds(eye.kept, &eye);
    }
    for (const Background& each : eye.backgrounds) resize(each.target);
    resize(eye.scene);
  }
  UseScale();
}

Optics::Target Optics::MakeTarget(int order, osg::Node* content) {
  Target target;
  target.colour = MakeColour();
  target.depth = MakeRenderTexture(GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT);
  target.camera = new osg::Camera;
  target.camera->setReferenceFrame(osg::Transform::ABSOLUTE_RF);
  target.camera->setRenderOrder(osg::Camera::PRE_RENDER, order);
  target.camera->setRenderTargetImplementation(osg::Camera::FRAME_BUFFER_OBJECT);
  target.camera->attach(osg::Camera::COLOR_BUFFER, target.colour);
  target.camera->attach(osg::Camera::DEPTH_BUFFER, target.depth);
  target.camera->setComputeNearFarMode(osg::Camera::DO_NOT_COMPUTE_NEAR_FAR);
  target.camera->setCullingMode(osg::CullSettings::NO_CULLING);
  target.camera->setFinalDrawCallback(new DrawnOnce(target.camera));
  target.camera->addChild(content);
  node_->addChild(target.camera);
  return target;
}

void Optics::AddField(Eye* eye) {
  // Clip coordinates of an eye's part: its centre and half its size, and the direction of the other eye's.
  osg::Vec4 part(0, 0, 1, 1);
  osg::Vec2 border;
  const float side = eyes_.empty() ? 1 : -1;  // The left eye is on the left, or on top.
  if (layout_ == StereoLayout::kSideBySide) {
    part.set(-0.5f * side, 0, 0.5f, 1);
    border.set(side, 0);
  } else if (layout_ == StereoLayout::kTopBottom) {
    part.set(0, 0.5f * side, 1, 0.5f);
    border.set(0, -side);
  }
  Mesh field("field", false);
  const osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  node_->addChild(geode);
  osg::StateSet* state = geode->getOrCreateStateSet();
  for (osg::Uniform* uniform :
       {new osg::Uniform("scene_picture", static_cast<int>(kPictureUnit)), new osg::Uniform("part", part),
        new osg::Uniform("border", border), texture_scale_.get(), texture_most_.get(), pixel_.get(), soil_.get(),
        haze_.get(), smoke_.get(), eye_pixels_.get(), reach_.get(),
        new osg::Uniform("scene_depth", static_cast<int>(kDepthUnit))}) {
    state->addUniform(uniform);
  }
  state->setTextureAttribute(kPictureUnit, eye->scene.colour);
  if (layout_ != StereoLayout::kNone) state->setMode(GL_CLIP_PLANE0, osg::StateAttribute::ON);
  state->setMode(GL_DEPTH_TEST, osg::StateAttribute::OFF);
  field.state()->setRenderBinDetails(0, "RenderBin");
  std::vector<Vec3f> positions;
  for (Index k = 0; k < kSides; ++k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kSides;
    positions.emplace_back(std::cos(angle), std::sin(angle), 0.0f);
  }
  // A square, then a triangle over each side, over its two sides, …: a fan's long edges cross four times as many blocks
  // of pixels, each of which is shaded for both sides.
  std::vector<Triangle> triangles{{0, kSides / 4, kSides / 2}, {0, kSides / 2, 3 * kSides / 4}};
  for (Index step = kSides / 4; step > 1; step /= 2) {
    for (Index k = 0; k < kSides; k += step) triangles.push_back({k, k + step / 2, (k + step) % kSides});
  }
  field.SetPositions(positions);
  field.SetTriangles(triangles);
  geode->addDrawable(field.geometry());
  eye->field = field.state();
  eye->edge_lines = std::make_shared<EdgeLines>();
  eye->edge_lines->state()->setTextureAttribute(kDepthUnit, eye->scene.depth);
  eye->edges = new osg::Geode;
  eye->edges->setStateSet(state);
  eye->edges->addDrawable(eye->edge_lines->geometry());
  node_->addChild(eye->edges);
}

void Optics::SetScale(float scale) {
  if (scale == scale_) return;
  scale_ = scale;
  if (smoothed()) {
    ResizeTextures();
  } else {
    UseScale();
  }
}

void Optics::UseScale() {
  const int width = Pixels(width_), height = Pixels(height_);
  for (const Eye& eye : eyes_) {
    for (const Background& each : eye.backgrounds) each.target.camera->setViewport(0, 0, width, height);
    eye.scene.camera->setViewport(0, 0, width, height);
  }
  const osg::Vec2 share(static_cast<float>(width) / static_cast<float>(width_),
                        static_cast<float>(height) / static_cast<float>(height_));
  radius_->set(osg::Vec2(circle_radius_.x(), circle_radius_.y()) * share.y());
  centre_->set(osg::Vec2(picture_centre_.x() * share.x(), picture_centre_.y() * share.y()));
  half_->set(osg::Vec2(half_height_.x(), half_height_.y()) * share.y());
  // The field's texture is the mean of the scene's pictures, or one of them.
  const std::array size = smoothed() ? std::array{width_, height_} : std::array{Texels(width_), Texels(height_)};
  const osg::Vec2 texel(1.0f / static_cast<float>(size[0]), 1.0f / static_cast<float>(size[1]));
  const osg::Vec2 used = smoothed()
                             ? osg::Vec2(1, 1)
                             : osg::Vec2(static_cast<float>(width) * texel.x(), static_cast<float>(height) * texel.y());
  texture_scale_->set(used);
  // Texels beyond this hold an older picture of another resolution.
  texture_most_->set(used - texel * 0.5f);
  eye_pixels_->set(osg::Vec2(static_cast<float>(width_), static_cast<float>(height_)));
  reach_->set(EdgeLines::kReach / share.y());
  pixel_->set(osg::Vec2(used.x() / static_cast<float>(width_), used.y() / static_cast<float>(height_)));
  UseLens();
  edges_changed_ = true;
  BackgroundsChanged();
}

void Optics::SetEyes(std::span<const Laparoscope> eyes) {
  for (std::size_t k = 0; k < eyes_.size(); ++k) {
    Eye& eye = eyes_[k];
    const Laparoscope& seen = eyes[k];
    eye.light_position->set(osg::Vec3(seen.light_position.x(), seen.light_position.y(), seen.light_position.z()));
    eye.seen = seen;
  }
  EdgesChanged();
}

void Optics::Eye::Look() {
  const Laparoscope from = smoothed ? smoothed->Jittered(seen) : seen;
  shows_mean = smoothed && !smoothed->moves();
  field->setTextureAttribute(kPictureUnit, shows_mean ? mean : scene.colour);
  LookFrom(from, scene.camera);
  const auto is_of = [&](const Background& each) {
    return each.from && each.from->view == from.view && each.from->projection == from.projection &&
           each.from->light_power == from.light_power;
  };
  Background& before = backgrounds[used];
  if (is_of(before)) return;
  if (before.target.camera->getNodeMask() != 0) {
    before.from.reset();  // It has not been drawn.
    before.target.camera->setNodeMask(0);
  }
  before.copy->setNodeMask(0);
  const auto found = std::ranges::find_if(backgrounds, is_of);
  used = found != backgrounds.end() ? static_cast<std::size_t>(found - backgrounds.begin()) : (used + 1) % kept;
  Background& next = backgrounds[used];
  next.copy->setNodeMask(~0u);
  if (is_of(next)) return;
  LookFrom(from, next.target.camera);
  next.target.camera->setNodeMask(~0u);
  next.from = from;
}

void Optics::SetEdges(FindEdges find) {
  find_edges_ = std::move(find);
  EdgesChanged();
}

void Optics::UpdateEdges() {
  float soil = 0, reach = 1;
  (void)soil_->get(soil);
  (void)reach_->get(reach);
  const Vec2f size(static_cast<float>(width_), static_cast<float>(height_));
  bool found = true;
  for (Eye& eye : eyes_) {
    // The mean of several pictures has smooth edges, and no depth of its own.
    const bool shown = find_edges_ && scale_ <= 1 && soil <= 0 && !eye.shows_mean;
    eye.edges->setNodeMask(shown ? ~0u : 0u);
    found = found && shown;
    if (!shown || !edges_changed_) continue;
    lines_.clear();
    find_edges_(eye.seen, size, &lines_);
    eye.edge_lines->Set(lines_, eye.seen, size, circle_radius_, reach);
  }
  if (found) edges_changed_ = false;
}

void Optics::SetSoil(float soil) {
  soil_->set(soil);
  UseLens();
}

void Optics::SetLight(const Vec3f& light) {
  constexpr std::array kLitSmoke{0.30f, 0.25f, 0.228f};
  osg::Vec3 seen;
  for (int k = 0; k < 3; ++k) {
    const float y = 1 / (1 + kLitSmoke.at(static_cast<std::size_t>(k)) * light[k]);
    seen[k] = std::sqrt(1 - y * y);  // ToneMap of lighting.glsl.
  }
  smoke_->set(seen);
}

void Optics::UseLens() {
  float soil = 0;
  (void)soil_->get(soil);
  osg::Program* lens = (soil > 0 ? soiled_lens_ : scale_ > 1 ? smooth_lens_ : clear_lens_).get();
  for (const Eye& eye : eyes_) eye.field->setAttributeAndModes(lens);
}

void Optics::EdgesChanged() {
  edges_changed_ = true;
  SceneChanged();
}

void Optics::SceneChanged() {
  for (Eye& eye : eyes_) {
    if (eye.smoothed) eye.smoothed->Changed();
    eye.Draw();
  }
}

bool Optics::Refine() {
  if (!smoothed() || !eyes_.front().smoothed->improves()) return false;
  for (Eye& eye : eyes_) eye.Draw();
  return true;
}

bool Optics::DrawsBackgroundAtRest() const {
  return smoothed() && std::ranges::any_of(eyes_, [](const Eye& eye) {
           return !eye.smoothed->moves() && eye.backgrounds[eye.used].target.camera->getNodeMask() != 0;
         });
}

void Optics::Eye::Draw() {
  scene.camera->setNodeMask(~0u);
  Look();
}

void Optics::BackgroundsChanged() {
  for (Eye& eye : eyes_) {
    for (Background& each : eye.backgrounds) {
      each.target.camera->setNodeMask(0);
      each.from.reset();
    }
  }
  SceneChanged();
}

}  // namespace fulcrum::render
