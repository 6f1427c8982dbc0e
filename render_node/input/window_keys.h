// What the keys of a keyboard mean at the window.
#pragma once

#include <optional>
#include <span>

#include "services/base/core/mouse_hands.h"

namespace fulcrum::render {

/// Meaning of a key for the hands: that of the first of its symbols that has one. @param symbols what X11 says that the
/// key writes alone and with Shift: some keyboards have digits with Shift only, and the keypad with Num Lock.
[[nodiscard]] std::optional<HandsKey> HandsKeyOf(std::span<const unsigned long> symbols);

}  // namespace fulcrum::render
