#include "render_node/scene_graph/optics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "render_node/offscreen/framebuffer.h"
#include "render_node/scene_graph/mesh.h"
#include "render_node/scene_graph/order.h"
#include "render_node/scene_graph/program.h"

namespace fulcrum::render {
namespace {

constexpr unsigned kPictureUnit = 6;  // A texture unit that no other shader uses.
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

/// Disables its camera after a picture, until something has changed.
class DrawnOnce : public osg::Camera::DrawCallback {
 public:
  explicit DrawnOnce(osg::Camera* camera) : camera_(camera) {}
  void operator()(osg::RenderInfo&) const override { camera_->setNodeMask(0); }

 private:
  osg::Camera* camera_;  // Owns this.
};

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

Optics::Optics(const Laparoscope& scope, int width, int height, osg::Node* background, osg::Node* scene)
    : scope_(scope),
      width_(width),
      height_(height),
      node_(new osg::Group),
      circle_radius_(new osg::Uniform("circle_radius", 1.0f)),
      picture_centre_(new osg::Uniform("picture_centre", osg::Vec2())),
      texture_scale_(new osg::Uniform("texture_scale", osg::Vec2(1, 1))),
      texture_most_(new osg::Uniform("texture_most", osg::Vec2(1, 1))),
      pixel_(new osg::Uniform("pixel", osg::Vec2())),
      soil_(new osg::Uniform("soil", 0.0f)),
      haze_(new osg::Uniform("haze", 0.0f)),
      smoke_(new osg::Uniform("smoke", osg::Vec3())),
      clear_lens_(MakeProgram("field.vert", "field.frag")),
      smooth_lens_(MakeProgram("field.vert", "smooth.frag")),
      soiled_lens_(MakeProgram("field.vert", "soiled.frag")) {
  osg::StateSet* state = node_->getOrCreateStateSet();
  state->addUniform(circle_radius_);
  state->addUniform(picture_centre_);
  for (Background& each : backgrounds_) {
    each.target = MakeTarget(0, background);
    each.target.camera->setClearColor(osg::Vec4(0.12f, 0.035f, 0.03f, 1));
  }
  scene_ = MakeTarget(1, scene);
  scene_.camera->setClearMask(0);
  for (Background& each : backgrounds_) {
    each.copy = new osg::Geode;
    each.copy->addDrawable(new CopyTarget(each.target, scene_));
    scene_.camera->addChild(each.copy);
  }
  AddField();
  SetLight(Vec3f::Ones());
  SetScope(scope);
  UseScale();
}

void Optics::SetSize(const Laparoscope& scope, int width, int height) {
  scope_ = scope;
  width_ = width;
  height_ = height;
  scene_.camera->setProjectionMatrix(ToOsg(scope.projection));
  backgrounds_[used_].target.camera->setProjectionMatrix(ToOsg(scope.projection));
  backgrounds_[used_].from = scope;
  ResizeTextures();
}

void Optics::SetMostScale(float most) {
  if (most == most_) return;
  most_ = most;
  ResizeTextures();
}

int Optics::Texels(int pixels) const { return static_cast<int>(std::lround(most_ * static_cast<float>(pixels))); }

void Optics::ResizeTextures() {
  for (const Target& target : {backgrounds_[0].target, backgrounds_[1].target, scene_}) {
    for (osg::Texture2D* texture : {target.colour.get(), target.depth.get()}) {
      texture->setTextureSize(Texels(width_), Texels(height_));
      texture->dirtyTextureObject();
    }
    // Without this OpenSceneGraph keeps the framebuffer of the previous textures.
    target.camera->dirtyAttachmentMap();
  }
  UseScale();
}

Optics::Target Optics::MakeTarget(int order, osg::Node* content) {
  const auto make_texture = [this](GLint internal, GLenum format, GLenum type) {
    osg::ref_ptr<osg::Texture2D> texture = new osg::Texture2D;
    texture->setTextureSize(width_, height_);
    texture->setInternalFormat(internal);
    texture->setSourceFormat(format);
    texture->setSourceType(type);
    texture->setFilter(osg::Texture::MIN_FILTER, osg::Texture::LINEAR);
    texture->setFilter(osg::Texture::MAG_FILTER, osg::Texture::LINEAR);
    texture->setWrap(osg::Texture::WRAP_S, osg::Texture::CLAMP_TO_EDGE);
    texture->setWrap(osg::Texture::WRAP_T, osg::Texture::CLAMP_TO_EDGE);
    texture->setResizeNonPowerOfTwoHint(false);
    return texture;
  };
  Target target;
  target.colour = make_texture(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE);
  target.depth = make_texture(GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT);
  target.camera = new osg::Camera;
  target.camera->setReferenceFrame(osg::Transform::ABSOLUTE_RF);
  target.camera->setRenderOrder(osg::Camera::PRE_RENDER, order);
  target.camera->setRenderTargetImplementation(osg::Camera::FRAME_BUFFER_OBJECT);
  target.camera->attach(osg::Camera::COLOR_BUFFER, target.colour);
  target.camera->attach(osg::Camera::DEPTH_BUFFER, target.depth);
  target.camera->setComputeNearFarMode(osg::Camera::DO_NOT_COMPUTE_NEAR_FAR);
  target.camera->setCullingMode(osg::CullSettings::NO_CULLING);
  target.camera->setProjectionMatrix(ToOsg(scope_.projection));
  target.camera->setFinalDrawCallback(new DrawnOnce(target.camera));
  target.camera->addChild(content);
  node_->addChild(target.camera);
  return target;
}

void Optics::AddField() {
  Mesh field("field", false);
  field_state_ = field.state();
  field_state_->setAttributeAndModes(clear_lens_);
  field.state()->addUniform(new osg::Uniform("scene_picture", static_cast<int>(kPictureUnit)));
  field.state()->addUniform(texture_scale_);
  field.state()->addUniform(texture_most_);
  field.state()->addUniform(pixel_);
  field.state()->addUniform(soil_);
  field.state()->addUniform(haze_);
  field.state()->addUniform(smoke_);
  field.state()->setMode(GL_DEPTH_TEST, osg::StateAttribute::OFF);
  field.state()->setRenderBinDetails(0, "RenderBin");
  std::vector<Vec3f> positions{Vec3f::Zero()};
  std::vector<Triangle> triangles;
  for (Index k = 0; k < kSides; ++k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kSides;
    positions.emplace_back(std::cos(angle), std::sin(angle), 0.0f);
    triangles.push_back({0, 1 + k, 1 + (k + 1) % kSides});
  }
  field.SetPositions(positions);
  field.SetTriangles(triangles);
  const osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  geode->addDrawable(field.geometry());
  node_->addChild(geode);
  node_->getOrCreateStateSet()->setTextureAttribute(kPictureUnit, scene_.colour);
}

void Optics::SetScale(float scale) {
  if (scale == scale_) return;
  scale_ = scale;
  UseScale();
}

void Optics::UseScale() {
  const auto pixels = [this](int full) {
    return std::clamp(static_cast<int>(std::lround(scale_ * static_cast<float>(full))), 1, Texels(full));
  };
  const int width = pixels(width_), height = pixels(height_);
  for (const Background& each : backgrounds_) each.target.camera->setViewport(0, 0, width, height);
  scene_.camera->setViewport(0, 0, width, height);
  const osg::Vec2 share(static_cast<float>(width) / static_cast<float>(width_),
                        static_cast<float>(height) / static_cast<float>(height_));
  circle_radius_->set(scope_.circle_radius * share.y());
  picture_centre_->set(osg::Vec2(scope_.picture_centre.x() * share.x(), scope_.picture_centre.y() * share.y()));
  const osg::Vec2 texel(1.0f / static_cast<float>(Texels(width_)), 1.0f / static_cast<float>(Texels(height_)));
  const osg::Vec2 used(static_cast<float>(width) * texel.x(), static_cast<float>(height) * texel.y());
  texture_scale_->set(used);
  // Texels beyond this hold an older picture of another resolution.
  texture_most_->set(used - texel * 0.5f);
  pixel_->set(osg::Vec2(used.x() / static_cast<float>(width_), used.y() / static_cast<float>(height_)));
  UseLens();
  BackgroundsChanged();
}

void Optics::SetScope(const Laparoscope& scope) {
  const osg::Matrix view = ToOsg(scope.view), projection = ToOsg(scope.projection);
  scene_.camera->setViewMatrix(view);
  scene_.camera->setProjectionMatrix(projection);
  SceneChanged();
  for (const std::size_t k : {used_, 1 - used_}) {
    const std::optional<Laparoscope>& from = backgrounds_[k].from;
    if (from && from->view == scope.view && from->projection == scope.projection &&
        from->light_power == scope.light_power) {
      return Use(k);
    }
  }
  Use(1 - used_);
  Background& next = backgrounds_[used_];
  next.target.camera->setViewMatrix(view);
  next.target.camera->setProjectionMatrix(projection);
  next.target.camera->setNodeMask(~0u);
  next.from = scope;
}

void Optics::Use(std::size_t background) {
  Background &before = backgrounds_[used_], &now = backgrounds_[background];
  if (background != used_ && before.target.camera->getNodeMask() != 0) {
    before.from.reset();  // It has not been drawn.
    before.target.camera->setNodeMask(0);
  }
  before.copy->setNodeMask(0);
  now.copy->setNodeMask(~0u);
  used_ = background;
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
  field_state_->setAttributeAndModes(soil > 0 ? soiled_lens_ : scale_ > 1 ? smooth_lens_ : clear_lens_);
}

void Optics::SceneChanged() { scene_.camera->setNodeMask(~0u); }

void Optics::BackgroundsChanged() {
  Background &now = backgrounds_[used_], &other = backgrounds_[1 - used_];
  now.target.camera->setNodeMask(~0u);
  other.target.camera->setNodeMask(0);
  other.from.reset();
  SceneChanged();
}

}  // namespace fulcrum::render
