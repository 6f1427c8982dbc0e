// Jaws and pedals by the buttons of the haptic devices, for a cart without handles or pedal, and while a handle or the
// pedal is not there. Buttons come with ToolState; a released button opens the jaw at a finite rate.
#pragma once

#include <array>
#include <cstdint>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/transport/bus/port.h"

namespace fulcrum::handle_bridge {

/// True if buttons operate a handle or the pedal of the cart, always or as long as the line is not there.
[[nodiscard]] bool NeedsButtons(const config::CartConfig& cart);

class ButtonHands {
 public:
  /// @param tools null: no button operates anything.
  ButtonHands(const config::CartConfig& cart, bus::Input<ToolState>* tools);

  /// Takes the newest ToolState, once a period. @param now_ns CLOCK_MONOTONIC [ns].
  void Read(std::int64_t now_ns);

  /// Number of the button that closes the jaw of a tool, from 1; 0: none does, even if the handle is not there.
  [[nodiscard]] int button(std::size_t tool) const { return tools_ == nullptr ? 0 : buttons_[tool]; }
  /// The button's jaw, or that of the handle; from one to the other, and from open to closed, the angle moves at a
  /// finite rate. @param line what the handle's line says. @param by_button the button closes the jaw now.
  [[nodiscard]] HandleSample Jaw(std::size_t tool, const HandleSample& line, bool by_button, double dt_s);

  [[nodiscard]] bool has_pedals() const { return tools_ != nullptr && pedals_by_button_; }
  /// Pedals whose buttons are pressed.
  [[nodiscard]] std::uint8_t Pedals() const;

 private:
  [[nodiscard]] bool Pressed(const config::ToolButton& button) const;

  bus::Input<ToolState>* tools_;
  std::array<int, kMaxTools> buttons_{};
  bool pedals_by_button_ = false;
  config::ToolButton cut_, coag_;
  ToolState state_;
  bool fresh_ = false;  ///< The newest ToolState is not too old to be believed.
  struct OneJaw {
    float angle_rad = 0;
    bool moves = false;  ///< On its way from button to handle or back.
    bool by_button = false, known = false;
  };
  std::array<OneJaw, kMaxTools> jaws_;
};

}  // namespace fulcrum::handle_bridge
