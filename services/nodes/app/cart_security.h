// Converts the security section of the cart file into the settings of the bus.
#pragma once

#include <string>
#include <string_view>

#include "services/base/config/cart.h"
#include "services/transport/bus/security.h"

namespace fulcrum::app {

[[nodiscard]] inline bus::Security SecurityOf(const config::CartConfig& cart, std::string_view identity) {
  return {cart.security.keys, std::string(identity), cart.security.encrypt};
}

}  // namespace fulcrum::app
