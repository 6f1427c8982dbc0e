#include "services/session/supervisor/dump_trigger.h"

#include <utility>

namespace fulcrum::supervisor {

DumpTrigger::DumpTrigger(double keep_s, std::filesystem::path folder, NodeOrders* orders)
    : keep_s_(keep_s), folder_(std::move(folder)), orders_(orders) {}

void DumpTrigger::OnFault(const std::string& reason, std::int64_t now_ns) {
  if (keep_s_ <= 0 || now_ns < next_ns_) return;
  next_ns_ = now_ns + static_cast<std::int64_t>(1e9 * keep_s_);
  orders_->Send(NodeId::kRecorder, "dump", reason);
}

CommandAnswer DumpTrigger::OnCommand(const std::string& reason, std::int64_t now_ns) {
  if (keep_s_ <= 0)
    return {false, "this session keeps no data for dumps; start it with fulcrum up --keep-last SECONDS"};
  next_ns_ = 0;
  OnFault(reason, now_ns);
  return {true, "writing the last seconds into " + folder_.string()};
}

}  // namespace fulcrum::supervisor
