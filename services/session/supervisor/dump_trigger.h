// When the recorder writes the newest seconds to a file: after a fault, or on command.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "services/session/supervisor/command_desk.h"
#include "services/session/supervisor/node_orders.h"

namespace fulcrum::supervisor {

class DumpTrigger {
 public:
  /// @param keep_s time that a dump covers [s]; 0: the recorder keeps nothing, and no dump is written.
  /// @param folder of the session; the reply to a command names it.
  /// @param orders must outlive this.
  DumpTrigger(double keep_s, std::filesystem::path folder, NodeOrders* orders);

  /// Requests a dump after a fault, at most one in the time that a dump covers: an earlier dump contains the fault.
  void OnFault(const std::string& reason, std::int64_t now_ns);
  CommandAnswer OnCommand(const std::string& reason, std::int64_t now_ns);

 private:
  const double keep_s_;
  const std::filesystem::path folder_;
  NodeOrders* const orders_;
  std::int64_t next_ns_ = 0;
};

}  // namespace fulcrum::supervisor
