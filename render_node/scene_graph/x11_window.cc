#include "render_node/scene_graph/x11_window.h"

// Its X11 headers define words such as None and Bool as macros: this file is compiled by itself.
#include <X11/Xatom.h>

#include <algorithm>
#include <osgViewer/api/X11/GraphicsWindowX11>
#include <span>

namespace fulcrum::render {
namespace {

constexpr long kToggle = 2;  // _NET_WM_STATE_TOGGLE
constexpr long kFromApplication = 1;

/// True if a window manager runs that knows how to make a window full screen (Extended Window Manager Hints).
bool ManagerHas(::Display* display, ::Window root, Atom wanted) {
  Atom type = 0;
  int format = 0;
  unsigned long count = 0, left = 0;
  unsigned char* data = nullptr;
  constexpr long kMost = 1024;
  if (XGetWindowProperty(display, root, XInternAtom(display, "_NET_SUPPORTED", False), 0, kMost, False, XA_ATOM, &type,
                         &format, &count, &left, &data) != Success ||
      data == nullptr) {
    return false;
  }
  // Xlib gives items of 32 bits as longs.
  const std::span<const Atom> atoms(reinterpret_cast<const Atom*>(data), format == 32 ? count : 0);
  const bool found = std::find(atoms.begin(), atoms.end(), wanted) != atoms.end();
  XFree(data);
  return found;
}

}  // namespace

X11Window::X11Window(osg::GraphicsContext* context) : context_(context) {}

unsigned long X11Window::id() const {
  auto* const window = dynamic_cast<osgViewer::GraphicsWindowX11*>(context_);
  return window == nullptr ? 0 : window->getWindow();
}

void X11Window::ToggleFullScreen() {
  auto* const context = dynamic_cast<osgViewer::GraphicsWindowX11*>(context_);
  if (context == nullptr) return;
  ::Display* const display = context->getEventDisplay();
  const ::Window window = context->getWindow();
  XWindowAttributes attributes;
  if (display == nullptr || XGetWindowAttributes(display, window, &attributes) == 0) return;
  const Atom full = XInternAtom(display, "_NET_WM_STATE_FULLSCREEN", False);
  if (ManagerHas(display, attributes.root, full)) {
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = window;
    event.xclient.message_type = XInternAtom(display, "_NET_WM_STATE", False);
    event.xclient.format = 32;
    event.xclient.data.l[0] = kToggle;
    event.xclient.data.l[1] = static_cast<long>(full);
    event.xclient.data.l[3] = kFromApplication;
    XSendEvent(display, attributes.root, False, SubstructureRedirectMask | SubstructureNotifyMask, &event);
  } else if (before_.width == 0) {
    before_ = {attributes.x, attributes.y, static_cast<unsigned>(attributes.width),
               static_cast<unsigned>(attributes.height)};
    XMoveResizeWindow(display, window, 0, 0, static_cast<unsigned>(WidthOfScreen(attributes.screen)),
                      static_cast<unsigned>(HeightOfScreen(attributes.screen)));
  } else {
    XMoveResizeWindow(display, window, before_.x, before_.y, before_.width, before_.height);
    before_ = {};
  }
  XFlush(display);
}

}  // namespace fulcrum::render
