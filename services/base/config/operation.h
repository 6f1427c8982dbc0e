// Who moves the tools of a session.
#pragma once

#include <array>

#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::config {

/// True if a person moves a tool of the scene, with a Touch or by an operator's input: no script sets the session's
/// length then, and an assistant stays at what its script holds last.
[[nodiscard]] bool MovedByPerson(const CartConfig& cart, const std::array<ToolDescription, kMaxTools>& tools);

/// The cart has a Touch: its trainees operate with it.
[[nodiscard]] bool HasTouch(const CartConfig& cart);

/// Replaces devices, handles and pedal by simulated ones, which follow the scene's script.
void LetScriptMove(CartConfig* cart);

}  // namespace fulcrum::config
