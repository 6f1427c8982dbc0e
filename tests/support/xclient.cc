#include "tests/support/xclient.h"

// X11's headers define words such as None and Bool as macros: this file is compiled by itself.
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/keysym.h>

#include <stdexcept>

namespace fulcrum::testing {

struct XClient::Impl {
  ::Display* display = nullptr;
  ::Window window = 0;

  ::Window Find(::Window below, const std::string& name) const {
    char* own = nullptr;
    if (XFetchName(display, below, &own) != 0) {
      const bool found = name == own;
      XFree(own);
      if (found) return below;
    }
    ::Window root = 0, parent = 0, *children = nullptr;
    unsigned count = 0;
    ::Window found = 0;
    if (XQueryTree(display, below, &root, &parent, &children, &count) == 0) return 0;
    for (unsigned i = 0; i < count && found == 0; ++i) found = Find(children[i], name);
    if (children != nullptr) XFree(children);
    return found;
  }
};

XClient::XClient(const std::string& display) : impl_(std::make_unique<Impl>()) {
  impl_->display = XOpenDisplay(display.c_str());
  if (impl_->display == nullptr) throw std::runtime_error("display " + display + " does not answer");
}
XClient::~XClient() { XCloseDisplay(impl_->display); }

bool XClient::FindWindow(const std::string& name) {
  impl_->window = impl_->Find(DefaultRootWindow(impl_->display), name);
  return impl_->window != 0;
}

void XClient::Move(int x, int y) {
  XWarpPointer(impl_->display, 0, 0, 0, 0, 0, 0, x, y);
  XFlush(impl_->display);
}

void XClient::Resize(int width, int height) {
  XMoveResizeWindow(impl_->display, impl_->window, 0, 0, static_cast<unsigned>(width), static_cast<unsigned>(height));
  XSync(impl_->display, False);
}

std::vector<unsigned char> XClient::Pixels(int x, int y, int size) {
  XImage* const image = XGetImage(impl_->display, impl_->window, x, y, static_cast<unsigned>(size),
                                  static_cast<unsigned>(size), AllPlanes, ZPixmap);
  if (image == nullptr) return {};
  const auto bytes = static_cast<std::size_t>(image->bytes_per_line) * static_cast<std::size_t>(size);
  std::vector<unsigned char> pixels(image->data, image->data + bytes);
  XDestroyImage(image);
  return pixels;
}

WindowPicture XClient::Whole() {
  XWindowAttributes attributes;
  if (XGetWindowAttributes(impl_->display, impl_->window, &attributes) == 0) return {};
  WindowPicture picture{attributes.width, attributes.height, {}};
  XImage* const image = XGetImage(impl_->display, impl_->window, 0, 0, static_cast<unsigned>(picture.width),
                                  static_cast<unsigned>(picture.height), AllPlanes, ZPixmap);
  if (image == nullptr) return {};
  if (image->bits_per_pixel == 32) {
    picture.bgrx.assign(image->data, image->data + static_cast<std::ptrdiff_t>(image->bytes_per_line) * picture.height);
  }
  XDestroyImage(image);
  return picture;
}

void XClient::Press(const std::string& key, bool down) {
  XEvent event{};
  event.xkey.type = down ? KeyPress : KeyRelease;
  event.xkey.display = impl_->display;
  event.xkey.window = impl_->window;
  event.xkey.root = DefaultRootWindow(impl_->display);
  event.xkey.time = CurrentTime;
  event.xkey.same_screen = True;
  event.xkey.keycode = XKeysymToKeycode(impl_->display, XStringToKeysym(key.c_str()));
  XSendEvent(impl_->display, impl_->window, False, down ? KeyPressMask : KeyReleaseMask, &event);
  XFlush(impl_->display);
}

BareWindow::BareWindow(const std::string& display) : display_(XOpenDisplay(display.c_str())) {
  auto* const opened = static_cast<::Display*>(display_);
  if (opened == nullptr) throw std::runtime_error("no X server at " + display);
  id_ = XCreateSimpleWindow(opened, DefaultRootWindow(opened), 0, 0, 640, 360, 0, 0, 0);
  XMapWindow(opened, id_);
  XSync(opened, False);
}

BareWindow::~BareWindow() { XCloseDisplay(static_cast<::Display*>(display_)); }

}  // namespace fulcrum::testing
