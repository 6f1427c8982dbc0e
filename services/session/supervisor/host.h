// Nodes of a cart on a machine of their own: the cart's session says which, this host starts, watches and ends them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "services/base/core/exit_code.h"
#include "services/transport/bus/dds/far_participant.h"

namespace fulcrum::supervisor {

struct HostSettings {
  bus::FarSettings far;
  int domain = 7;                  ///< Of this host's own bus.
  std::uint32_t allowed = ~0u;     ///< Bit per NodeId: what a cart may have run here.
  std::filesystem::path out;       ///< The session folder is made in here.
  std::filesystem::path programs;  ///< Folder of the node programs.
  std::filesystem::path cache;     ///< Scenes are kept here by their hash.
  std::string quality = "auto";    ///< Of the picture.
  bool window = false;
};

/// Waits for a session of the cart, gets its scene, runs its nodes until the session is over or a stop signal comes.
/// Call from the main thread: children die with it. Throws InputError or MismatchError.
ExitCode RunHost(const HostSettings& settings);

}  // namespace fulcrum::supervisor
