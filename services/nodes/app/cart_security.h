// Security settings with which a process joins the bus of its cart.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "services/base/config/cart.h"
#include "services/transport/bus/security.h"

namespace fulcrum::app {

/// Settings of the cart file's security section.
[[nodiscard]] inline bus::Security SecurityOf(const config::CartConfig& cart, std::string_view identity) {
  return {cart.security.keys, std::string(identity), cart.security.encrypt};
}

/// The same, and without keys there, those that the running session has announced in the cart's private directory.
[[nodiscard]] inline bus::Security SecurityOf(const config::CartConfig& cart, const std::filesystem::path& memory,
                                              std::string_view identity) {
  return cart.security.keys.empty() ? bus::AnnouncedSecurity(memory, identity) : SecurityOf(cart, identity);
}

}  // namespace fulcrum::app
