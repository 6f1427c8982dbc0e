// Commands from the supervisor to nodes.
#pragma once

#include <memory>
#include <string>

#include "services/base/core/messages.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"

namespace fulcrum::supervisor {

class NodeOrders {
 public:
  explicit NodeOrders(std::unique_ptr<bus::Output<Command>> out);
  void Send(NodeId target, const std::string& verb, const std::string& argument = {});

 private:
  std::unique_ptr<bus::Output<Command>> out_;
  bus::Stamper stamper_;
};

}  // namespace fulcrum::supervisor
