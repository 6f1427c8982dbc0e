// Pointer and keys of an X11 window, and gamepads, read on a thread of their own with a connection of their own: a
// picture takes tens of milliseconds to draw, and the hand must not wait for it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "services/base/core/mouse_hands.h"
#include "services/base/core/pad_hands.h"

namespace fulcrum::render {

/// What the picture shows of the hands.
struct HandsState {
  bool active = false;
  int tool = 1;
  bool scope = false;   ///< It is a scope.
  bool locked = false;  ///< Its jaw is locked.
  bool steady = false;
  bool gamepad = false;  ///< One is plugged in.
  bool operator==(const HandsState&) const = default;
};

class WindowInput {
 public:
  /// Called on the thread of the input for each change, and each kRepeat_ms while the controls are taken.
  using Sink = std::function<void(const OperatorInput&)>;
  static constexpr int kRepeat_ms = 20;

  /// @param display name of the X display; empty: that of the environment. @param window X window to be read. Throws
  /// InputError if the display cannot be opened.
  WindowInput(const std::string& display, unsigned long window, Sink sink, const InputSettings& settings = {});
  /// Releases the controls.
  ~WindowInput();
  WindowInput(const WindowInput&) = delete;
  WindowInput& operator=(const WindowInput&) = delete;

  // Any thread.
  void SetView(const HandsView& view);
  /// Takes the controls and the pointer, as Enter in the window does; for a click, which the window receives.
  void Take() { wants_take_.store(true, std::memory_order_relaxed); }
  /// Another source may have claimed the controls at this time [ns]: if it was later than this window, the window
  /// releases them.
  void Yield(std::int64_t claim_ns) { other_claim_ns_.store(claim_ns, std::memory_order_relaxed); }
  [[nodiscard]] HandsState state() const;

 private:
  class Connection;
  void Run(const std::stop_token& stop);

  Sink sink_;
  InputSettings settings_;
  std::unique_ptr<Connection> connection_;
  std::atomic<bool> wants_take_{false};
  std::atomic<std::int64_t> other_claim_ns_{0};  ///< Relaxed: a single number.
  mutable std::mutex mutex_;                     ///< Guards the members below.
  HandsView view_;
  HandsState state_;
  std::jthread thread_;
};

}  // namespace fulcrum::render
