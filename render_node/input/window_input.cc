#include "render_node/input/window_input.h"

#include <poll.h>
// X11's headers define words such as None and Bool as macros: this file is compiled by itself.
#include <X11/XKBlib.h>
#include <X11/Xlib.h>
#include <X11/keysym.h>

#include <array>
#include <memory>

#include "render_node/input/pad_inputs.h"
#include "render_node/input/window_keys.h"
#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::render {
namespace {

constexpr unsigned kPointerEvents = ButtonPressMask | ButtonReleaseMask | PointerMotionMask;

// Xlib has one handler of errors for all connections of a process.
::Display* g_own = nullptr;
XErrorHandler g_before = nullptr;

/// Errors of this connection end nothing, because the window may be destroyed before the connection.
int HandleError(::Display* display, XErrorEvent* event) {
  return display == g_own || g_before == nullptr ? 0 : g_before(display, event);
}

}  // namespace

/// Owned by the thread of the input, but for its construction.
class WindowInput::Connection {
 public:
  Connection(const std::string& name, unsigned long window) : window_(window) {
    display_ = XOpenDisplay(name.empty() ? nullptr : name.c_str());
    if (display_ == nullptr) throw InputError("--hands mouse: the display cannot be opened a second time");
    g_own = display_;
    const XErrorHandler before = XSetErrorHandler(&HandleError);
    if (before != &HandleError) g_before = before;
    Bool supported = False;
    XkbSetDetectableAutoRepeat(display_, True, &supported);
    XSelectInput(display_, window_, KeyPressMask | KeyReleaseMask | FocusChangeMask | StructureNotifyMask);
    XFlush(display_);
  }
  ~Connection() { XCloseDisplay(display_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Waits for events, or until `other` (-1: none) is readable, at most `limit_ms`.
  void Wait(int limit_ms, int other) {
    if (XPending(display_) > 0) return;
    std::array<pollfd, 2> readable{{{ConnectionNumber(display_), POLLIN, 0}, {other, POLLIN, 0}}};
    (void)::poll(readable.data(), readable.size(), limit_ms);
  }

  /// Takes the controls once the pointer is free: a button that is still down belongs to the window's own connection.
  bool Take(MouseHands* hands, std::int64_t now_ns) {
    const Cursor cursor = Invisible();
    const int grabbed = XGrabPointer(display_, window_, False, kPointerEvents, GrabModeAsync, GrabModeAsync, window_,
                                     cursor, CurrentTime);
    XFreeCursor(display_, cursor);  // The grab keeps it.
    if (grabbed != GrabSuccess) return false;
    FindPointer();
    Centre();
    hands->Take(now_ns);
    return true;
  }
  void Release(MouseHands* hands) {
    hands->Release();
    XUngrabPointer(display_, CurrentTime);
    XFlush(display_);
  }

  /// Handles all events that have arrived. True if one of them concerned the hands. `take` is set when the operator
  /// asks for the controls.
  bool Handle(MouseHands* hands, bool* take) {
    bool any = false;
    while (XPending(display_) > 0) {
      XEvent event;
      XNextEvent(display_, &event);
      any = Handle(event, hands, take) || any;
    }
    return any;
  }

 private:
  bool Handle(const XEvent& event, MouseHands* hands, bool* take) {
    switch (event.type) {
      case KeyPress:
      case KeyRelease:
        return HandleKey(event.xkey, event.type == KeyPress, hands, take);
      case ButtonPress:
      case ButtonRelease:
        return HandleButton(event.xbutton.button, event.type == ButtonPress, hands);
      case MotionNotify:
        return HandleMotion(event.xmotion.x, event.xmotion.y, hands);
      case ConfigureNotify:
        // The window has moved beneath the pointer: that is no motion of the hand.
        if (hands->active()) FindPointer();
        return false;
      case FocusOut:
        // A grab of the window manager, as for Alt+Tab, is no loss of the window.
        if (!hands->active() || event.xfocus.mode == NotifyGrab) return false;
        Release(hands);
        return true;
      default:
        return false;
    }
  }

  bool HandleKey(const XKeyEvent& event, bool down, MouseHands* hands, bool* take) {
    const auto code = static_cast<KeyCode>(event.keycode);
    const std::array<KeySym, 2> symbols{XkbKeycodeToKeysym(display_, code, 0, 0),
                                        XkbKeycodeToKeysym(display_, code, 0, 1)};
    const KeySym symbol = symbols.front();
    if (!hands->active()) {
      if (symbol == XK_Return && down) *take = true;
      return false;
    }
    if (symbol == XK_Escape && down) {
      Release(hands);
      return true;
    }
    const auto key = HandsKeyOf(symbols);
    if (key) hands->Press(*key, down);
    return key.has_value();
  }

  static bool HandleButton(unsigned button, bool down, MouseHands* hands) {
    switch (button) {
      case Button1:
        hands->Press(HandsKey::kJaw, down);
        return true;
      case Button2:
        hands->Press(HandsKey::kCoag, down);
        return true;
      case Button3:
        hands->Press(HandsKey::kCut, down);
        return true;
      case Button4:
      case Button5:
        if (down) hands->Turn(button == Button4 ? 1 : -1);
        return down;
      default:
        return false;
    }
  }

  /// The pointer goes back to the middle before it reaches the border, so that its motion has no end.
  bool HandleMotion(int x, int y, MouseHands* hands) {
    const bool by_warp = warped_ && x == width_ / 2 && y == height_ / 2;
    const int by_x = by_warp ? 0 : x - x_, by_y = by_warp ? 0 : y - y_;
    x_ = x;
    y_ = y;
    if (by_warp) warped_ = false;
    if (by_x == 0 && by_y == 0) return false;
    hands->Move(static_cast<float>(by_x), static_cast<float>(-by_y));
    const bool near_border = x < width_ / 4 || x > 3 * width_ / 4 || y < height_ / 4 || y > 3 * height_ / 4;
    if (near_border && !warped_) Centre();
    return true;
  }

  void Centre() {
    XWindowAttributes attributes;
    if (XGetWindowAttributes(display_, window_, &attributes) == 0) return;
    width_ = attributes.width;
    height_ = attributes.height;
    XWarpPointer(display_, 0, window_, 0, 0, 0, 0, width_ / 2, height_ / 2);
    XFlush(display_);
    warped_ = true;
  }

  void FindPointer() {
    ::Window root = 0, child = 0;
    int root_x = 0, root_y = 0;
    unsigned mask = 0;
    XQueryPointer(display_, window_, &root, &child, &root_x, &root_y, &x_, &y_, &mask);
  }

  Cursor Invisible() {
    const char nothing = 0;
    XColor black{};
    const Pixmap pixel = XCreateBitmapFromData(display_, window_, &nothing, 1, 1);
    const Cursor cursor = XCreatePixmapCursor(display_, pixel, pixel, &black, &black, 0, 0);
    XFreePixmap(display_, pixel);
    return cursor;
  }

  ::Display* display_;
  const ::Window window_;
  int width_ = 1, height_ = 1;
  int x_ = 0, y_ = 0;    ///< Place of the pointer in the window.
  bool warped_ = false;  ///< The motion to the middle has not arrived yet.
};

WindowInput::WindowInput(const std::string& display, unsigned long window, Sink sink, const InputSettings& settings)
    : sink_(std::move(sink)), settings_(settings), connection_(std::make_unique<Connection>(display, window)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

WindowInput::~WindowInput() = default;

void WindowInput::SetView(const HandsView& view) {
  const std::lock_guard lock(mutex_);
  view_ = view;
}

HandsState WindowInput::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void WindowInput::Run(const std::stop_token& stop) {
  MouseHands hands(OperatorSource::kWindow);
  PadInputs pads(settings_);
  std::int64_t sent_ns = 0, claim_ns = 0;
  bool take = false;
  while (!stop.stop_requested()) {
    connection_->Wait(pads.Wait_ms(hands.active(), kRepeat_ms), pads.descriptor());
    float force_N = 0;
    {
      const std::lock_guard lock(mutex_);
      hands.SetView(view_);
      if (hands.active()) force_N = view_.force_N[static_cast<std::size_t>(hands.tool())];
    }
    const bool was_active = hands.active();
    bool changed = connection_->Handle(&hands, &take);
    const std::int64_t now_ns = runtime::MonotonicNs();
    const PadHands::Outcome pad = pads.Update(now_ns, &hands);
    pads.Rumble(force_N, now_ns);
    changed = changed || pad.changed;
    const bool taken_by_other = other_claim_ns_.load(std::memory_order_relaxed) > claim_ns;
    if ((pad.release || taken_by_other) && hands.active()) connection_->Release(&hands);
    take = wants_take_.exchange(false, std::memory_order_relaxed) || pad.take || take;
    if (take && !hands.active() && connection_->Take(&hands, now_ns)) {
      claim_ns = now_ns;
      changed = true;
    }
    take = take && !hands.active();
    const bool due = hands.active() && now_ns - sent_ns >= kRepeat_ms * 1'000'000LL;
    if (changed || due || was_active != hands.active()) {
      sink_(hands.At(now_ns));
      sent_ns = now_ns;
    }
    const std::lock_guard lock(mutex_);
    state_ = {hands.active(),
              hands.tool(),
              view_.scope[static_cast<std::size_t>(hands.tool())],
              hands.locked(hands.tool()),
              hands.steady(),
              pads.has_gamepad()};
  }
  if (hands.active()) {
    connection_->Release(&hands);
    sink_(hands.At(runtime::MonotonicNs()));
  }
}

}  // namespace fulcrum::render
