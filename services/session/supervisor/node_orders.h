// Orders from the supervisor to nodes of this host, through the socket of each node in the cart's private directory.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "services/base/core/messages.h"

namespace fulcrum::supervisor {

class NodeOrders {
 public:
  /// @param memory the cart's private directory.
  explicit NodeOrders(std::filesystem::path memory) : memory_(std::move(memory)) {}
  /// Waits for no reply. False if the node does not run.
  bool Send(NodeId target, const std::string& verb, const std::string& argument = {}) const;

 private:
  std::filesystem::path memory_;
};

}  // namespace fulcrum::supervisor
