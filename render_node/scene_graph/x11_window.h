// Number of the X11 window behind an OpenGL context.
#pragma once

#include <osg/GraphicsContext>

namespace fulcrum::render {

/// 0: the context has no X11 window.
[[nodiscard]] unsigned long X11WindowOf(osg::GraphicsContext* context);

}  // namespace fulcrum::render
