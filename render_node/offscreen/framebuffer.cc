#include "render_node/offscreen/framebuffer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <stdexcept>
#include <string>

namespace fulcrum::render {

Framebuffer::Framebuffer(int width, int height, int samples) : width_(width), height_(height) {
  const GLsizei count = samples > 1 ? samples : 0;
  glGenRenderbuffers(1, &colour_);
  glBindRenderbuffer(GL_RENDERBUFFER, colour_);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, count, GL_RGBA8, width, height);
  glGenRenderbuffers(1, &depth_);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, count, GL_DEPTH_COMPONENT24, width, height);
  glGenRenderbuffers(1, &resolved_colour_);
  glBindRenderbuffer(GL_RENDERBUFFER, resolved_colour_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);

  glGenFramebuffers(1, &resolve_);
  glBindFramebuffer(GL_FRAMEBUFFER, resolve_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, resolved_colour_);
  const GLenum resolve_status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  glGenFramebuffers(1, &draw_);
  glBindFramebuffer(GL_FRAMEBUFFER, draw_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_);
  const GLenum draw_status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  if (resolve_status != GL_FRAMEBUFFER_COMPLETE || draw_status != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("OpenGL refuses a framebuffer of " + std::to_string(width) + " x " +
                             std::to_string(height) + " with " + std::to_string(samples) + " samples");
  }
}

Framebuffer::~Framebuffer() {
  glDeleteFramebuffers(1, &draw_);
  glDeleteFramebuffers(1, &resolve_);
  glDeleteRenderbuffers(1, &colour_);
  glDeleteRenderbuffers(1, &depth_);
  glDeleteRenderbuffers(1, &resolved_colour_);
}

void Framebuffer::Read(Picture* picture) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, draw_);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolve_);
  glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, resolve_);
  ReadBoundFramebuffer(width_, height_, picture);
  glBindFramebuffer(GL_FRAMEBUFFER, draw_);
}

void ReadBoundFramebuffer(int width, int height, Picture* picture) {
  picture->width = width;
  picture->height = height;
  picture->rgb.resize(3u * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, picture->rgb.data());
}

}  // namespace fulcrum::render
