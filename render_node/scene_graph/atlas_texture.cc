#include "render_node/scene_graph/atlas_texture.h"

#include <cstring>
#include <osg/Image>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

GLenum Format(int channels) { return channels == 1 ? GL_RED : channels == 2 ? GL_RG : GL_RGBA; }
GLint InternalFormat(int channels) { return channels == 1 ? GL_R8 : channels == 2 ? GL_RG8 : GL_RGBA8; }

}  // namespace

class AtlasTexture::Upload : public osg::Texture2D::SubloadCallback {
 public:
  Upload(int width, int height, std::span<const std::uint8_t> texels, int channels)
      : width_(width), height_(height), channels_(channels), texels_(texels) {}

  void Add(const AtlasRect& rect) { pending_.push_back(rect); }

  void load(const osg::Texture2D&, osg::State&) const override {
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, InternalFormat(channels_), width_, height_, 0, Format(channels_), GL_UNSIGNED_BYTE,
                 texels_.data());
    pending_.clear();
  }

  void subload(const osg::Texture2D&, osg::State&) const override {
    if (pending_.empty()) {
      return;
    }
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, width_);
    for (const AtlasRect& r : pending_) {
      glTexSubImage2D(GL_TEXTURE_2D, 0, r.x, r.y, r.width, r.height, Format(channels_), GL_UNSIGNED_BYTE,
                      texels_.data() + static_cast<std::size_t>(channels_) * TexelIndex(r.x, r.y, width_));
    }
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    pending_.clear();
  }

 private:
  int width_, height_, channels_;
  std::span<const std::uint8_t> texels_;
  // OSG calls load and subload as const; drawing and updating share one thread.
  mutable std::vector<AtlasRect> pending_;
};

AtlasTexture::AtlasTexture(int width, int height, std::span<const std::uint8_t> texels, int channels)
    : texture_(new osg::Texture2D), upload_(new Upload(width, height, texels, channels)) {
  texture_->setTextureSize(width, height);
  texture_->setInternalFormat(InternalFormat(channels));
  texture_->setFilter(osg::Texture::MIN_FILTER, osg::Texture::LINEAR);
  texture_->setFilter(osg::Texture::MAG_FILTER, osg::Texture::LINEAR);
  texture_->setWrap(osg::Texture::WRAP_S, osg::Texture::CLAMP_TO_EDGE);
  texture_->setWrap(osg::Texture::WRAP_T, osg::Texture::CLAMP_TO_EDGE);
  texture_->setResizeNonPowerOfTwoHint(false);
  texture_->setDataVariance(osg::Object::DYNAMIC);
  texture_->setSubloadCallback(upload_);
}

AtlasTexture::~AtlasTexture() = default;

void AtlasTexture::Update(const AtlasRect& rect) {
  if (!rect.empty()) {
    upload_->Add(rect);
  }
}

osg::ref_ptr<osg::Texture2D> MakeTexture(int width, int height, int channels, const std::vector<std::uint8_t>& bytes,
                                         bool tile) {
  osg::ref_ptr<osg::Image> image = new osg::Image;
  image->allocateImage(width, height, 1, Format(channels), GL_UNSIGNED_BYTE);
  std::memcpy(image->data(), bytes.data(), bytes.size());
  image->setInternalTextureFormat(InternalFormat(channels));
  osg::ref_ptr<osg::Texture2D> texture = new osg::Texture2D(image);
  const auto wrap = tile ? osg::Texture::REPEAT : osg::Texture::CLAMP_TO_EDGE;
  texture->setWrap(osg::Texture::WRAP_S, wrap);
  texture->setWrap(osg::Texture::WRAP_T, wrap);
  // No mipmaps: at a few texels per pixel the selection of the level costs more than it saves.
  texture->setFilter(osg::Texture::MIN_FILTER, osg::Texture::LINEAR);
  texture->setFilter(osg::Texture::MAG_FILTER, osg::Texture::LINEAR);
  texture->setResizeNonPowerOfTwoHint(false);
  return texture;
}

}  // namespace fulcrum::render
