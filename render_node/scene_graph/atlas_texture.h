// An atlas on the GPU: uploaded completely once, then only changed texels (glTexSubImage2D).
#pragma once

#include <cstdint>
#include <osg/Texture2D>
#include <span>
#include <vector>

#include "render_node/geometry/atlas.h"

namespace fulcrum::render {

class AtlasTexture {
 public:
  /// Keeps a reference to `texels`: `channels` (2 or 4) * width * height bytes, row by row.
  AtlasTexture(int width, int height, std::span<const std::uint8_t> texels, int channels = 4);
  /// Keeps a reference to the texels of `atlas`.
  explicit AtlasTexture(const Atlas& atlas) : AtlasTexture(atlas.width(), atlas.height(), atlas.texels()) {}
  ~AtlasTexture();
  AtlasTexture(const AtlasTexture&) = delete;
  AtlasTexture& operator=(const AtlasTexture&) = delete;

  /// Schedules these texels for upload with the next picture.
  void Update(const AtlasRect& rect);
  [[nodiscard]] osg::Texture2D* texture() const { return texture_; }

 private:
  class Upload;
  osg::ref_ptr<osg::Texture2D> texture_;
  osg::ref_ptr<Upload> upload_;
};

/// A tiling or clamped texture from bytes: 1, 2 or 4 channels.
[[nodiscard]] osg::ref_ptr<osg::Texture2D> MakeTexture(int width, int height, int channels,
                                                       const std::vector<std::uint8_t>& bytes, bool tile);

}  // namespace fulcrum::render
