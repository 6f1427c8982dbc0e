#include "render_node/scene_graph/x11_window.h"

// Its X11 headers define words such as None and Bool as macros: this file is compiled by itself.
#include <osgViewer/api/X11/GraphicsWindowX11>

namespace fulcrum::render {

unsigned long X11WindowOf(osg::GraphicsContext* context) {
  auto* const window = dynamic_cast<osgViewer::GraphicsWindowX11*>(context);
  return window == nullptr ? 0 : window->getWindow();
}

}  // namespace fulcrum::render
