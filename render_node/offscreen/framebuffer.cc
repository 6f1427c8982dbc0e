#include "render_node/offscreen/framebuffer.h"

#include <GL/gl.h>
#include <GL/glext.h>

#include <stdexcept>
#include <string>

namespace fulcrum::render {

Framebuffer::Framebuffer(int width, int height) : width_(width), height_(height) {
  glGenRenderbuffers(1, &colour_);
  glBindRenderbuffer(GL_RENDERBUFFER, colour_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
  glGenRenderbuffers(1, &depth_);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, width, height);
  glGenFramebuffers(1, &id_);
  glBindFramebuffer(GL_FRAMEBUFFER, id_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("OpenGL refuses a picture of " + std::to_string(width) + " x " + std::to_string(height));
  }
}

Framebuffer::~Framebuffer() {
  glDeleteFramebuffers(1, &id_);
  glDeleteRenderbuffers(1, &colour_);
  glDeleteRenderbuffers(1, &depth_);
}

void Framebuffer::Bind() const { glBindFramebuffer(GL_FRAMEBUFFER, id_); }

void Framebuffer::Read(Bitmap* picture) {
  Bind();
  ReadBoundFramebuffer(0, 0, width_, height_, picture);
}

void CopyTexture(unsigned from, unsigned to, int width, int height) {
  glCopyImageSubData(from, GL_TEXTURE_2D, 0, 0, 0, 0, to, GL_TEXTURE_2D, 0, 0, 0, 0, width, height, 1);
}

void ReadTexture(unsigned texture, int width, int height, std::uint32_t* rgba) {
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glGetTextureSubImage(texture, 0, 0, 0, 0, width, height, 1, GL_RGBA, GL_UNSIGNED_BYTE, 4 * width * height, rgba);
}

void WriteTexture(unsigned texture, int width, int height, const std::uint32_t* rgba) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTextureSubImage2D(texture, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
}

void ReadBoundFramebuffer(int x, int y, int width, int height, Bitmap* picture) {
  picture->width = width;
  picture->height = height;
  picture->rgb.resize(3u * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(x, y, width, height, GL_RGB, GL_UNSIGNED_BYTE, picture->rgb.data());
}

}  // namespace fulcrum::render
