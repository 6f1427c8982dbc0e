#include "services/records/recording/time_order.h"

#include <algorithm>
#include <utility>

namespace fulcrum::recording {

bool TimeOrder::Next(McapMessage* message) {
  while (!ended_ && (held_.empty() || held_.begin()->first + kSettle_ns >= newest_ns_)) {
    McapMessage read{};
    if (!reader_.Next(&read)) {
      ended_ = true;
      break;
    }
    newest_ns_ = std::max(newest_ns_, read.log_time_ns);
    held_.emplace(read.log_time_ns, Held{read, {read.data.begin(), read.data.end()}});
  }
  if (held_.empty()) {
    return false;
  }
  given_ = std::move(held_.begin()->second);
  held_.erase(held_.begin());
  *message = given_.message;
  message->data = given_.data;
  return true;
}

}  // namespace fulcrum::recording
