// The nodes of a cart that run on a second machine: the cart's session names them, this host starts, watches and ends
// them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "services/base/config/cart.h"
#include "services/base/core/exit_code.h"
#include "services/transport/bus/dds/far_participant.h"

namespace fulcrum::supervisor {

struct HostSettings {
  bus::FarSettings far;
  int domain = config::DefaultDomain();  ///< Domain of this host's own bus.
  std::uint32_t allowed = ~0u;           ///< Nodes that a cart may start here, one bit per NodeId.
  std::filesystem::path out;             ///< Folder in which the session folder is made.
  std::filesystem::path programs;        ///< Folder of the node programs.
  std::filesystem::path cache;           ///< Folder of received scenes, named by their hash.
  /// Cart file of this host: services/session/supervisor/offered_cart.h says which of its keys count.
  std::optional<config::CartConfig> cart;
  std::string quality = "auto";  ///< Quality of the picture: auto, low, high.
  bool window = false;
};

/// Waits for a session of the cart, receives its scene, and runs its nodes until the session ends or a stop signal
/// arrives. Call from the main thread: the children are killed when the calling thread ends. Throws InputError or
/// MismatchError.
ExitCode RunHost(const HostSettings& settings);

}  // namespace fulcrum::supervisor
