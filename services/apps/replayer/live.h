// Publication of a recording on the bus in real time: as input of a node under development, or in place of a node.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/transport/bus/security.h"

namespace fulcrum::replay {

struct LiveSettings {
  std::filesystem::path recording;
  int domain = config::DefaultDomain();
  bus::Security security = {};  ///< Off: the settings of the session that runs in the domain are used.
  double from_s = 0;            ///< Start, as time after the first message of the recording, 0 or more [s].
  std::vector<NodeId> nodes;    ///< Nodes whose messages are published.
};

struct LiveResult {
  std::uint64_t published = 0, failed = 0, undecodable = 0;
  double latest_s = 0;  ///< Largest delay of a message [s].
};

/// Publishes the messages of those nodes, each when it is due, until the end of the recording or `stop`. Times in the
/// messages are shifted to the present, and epochs become times of this replay, so that readers accept them as live. Of
/// what is before `from_s`, only what a late joiner receives is sent. Commands and their replies are not sent. Throws
/// InputError, also where the recording ends before `from_s`.
LiveResult ReplayLive(const LiveSettings& settings, const std::function<bool()>& stop);

}  // namespace fulcrum::replay
