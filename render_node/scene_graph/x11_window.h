// The X11 window behind an OpenGL context.
#pragma once

#include <osg/GraphicsContext>

namespace fulcrum::render {

class X11Window {
 public:
  /// `context` must outlive this.
  explicit X11Window(osg::GraphicsContext* context);

  /// Number of the window; 0: the context has no X11 window.
  [[nodiscard]] unsigned long id() const;
  /// Makes the window as large as the screen, or again as it was before. The change arrives later, as any other of the
  /// window's size.
  void ToggleFullScreen();

 private:
  struct Place {
    int x = 0, y = 0;
    unsigned width = 0, height = 0;  ///< 0: none.
  };
  osg::GraphicsContext* context_;
  Place before_;  ///< Before full screen, where no window manager keeps it.
};

}  // namespace fulcrum::render
