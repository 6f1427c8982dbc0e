#include "services/session/supervisor/node_orders.h"

#include "services/transport/control/control_socket.h"

namespace fulcrum::supervisor {

bool NodeOrders::Send(NodeId target, const std::string& verb, const std::string& argument) const {
  return control::Tell(control::SocketOf(memory_, NodeName(target)), {verb, argument});
}

}  // namespace fulcrum::supervisor
