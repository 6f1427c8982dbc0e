#include "services/session/supervisor/node_orders.h"

#include <utility>

#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::supervisor {

NodeOrders::NodeOrders(std::unique_ptr<bus::Output<Command>> out)
    : out_(std::move(out)), stamper_(runtime::MonotonicNs()) {}

void NodeOrders::Send(NodeId target, const std::string& verb, const std::string& argument) {
  const std::int64_t now = runtime::MonotonicNs();
  Command order;
  order.stamp = stamper_.Next(now);
  order.request_id = static_cast<std::uint64_t>(now);
  order.target = target;
  order.verb = verb;
  order.argument = argument;
  out_->Write(order);
}

}  // namespace fulcrum::supervisor
