// A recording on the bus again, at wall-clock rate: for a node under development, or in the place of one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/security.h"

namespace fulcrum::replay {

struct LiveSettings {
  std::filesystem::path recording;
  int domain = 7;
  bus::Security security = {};  ///< Off: as the session that runs in the domain says.
  double from_s = 0;            ///< Of the recording, from its first message [s].
  std::vector<NodeId> nodes;    ///< Whose messages are published.
};

struct LiveResult {
  std::uint64_t published = 0, failed = 0, undecodable = 0;
  double latest_s = 0;  ///< How late a message was sent at most.
};

/// Publishes what those nodes sent, each message when it is due, until the end of the recording or `stop`. Times and
/// epochs in the messages are moved so that they are of now: to its readers the session takes place. Commands and their
/// replies are not sent again. Throws InputError.
LiveResult ReplayLive(const LiveSettings& settings, const std::function<bool()>& stop);

}  // namespace fulcrum::replay
