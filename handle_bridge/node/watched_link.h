// A link with what the node remembers of it: its speed, how often it came back, what is wrong with it.
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "handle_bridge/protocol/baud_search.h"
#include "handle_bridge/protocol/link_monitor.h"
#include "handle_bridge/serial/byte_link.h"

namespace fulcrum::handle_bridge {

class WatchedLink {
 public:
  /// @param baud the cart's.
  WatchedLink(std::unique_ptr<ByteLink> link, int baud) : link_(std::move(link)), search_(baud) {}

  ByteLink::Result Read(std::span<char> buffer) noexcept;
  /// After Read() of an open link: what its bytes were.
  void Judge(const LinkCounts& counts, double dt_s) noexcept;
  /// `channel` is what the bytes alone say while the link is open.
  [[nodiscard]] LinkState state(LinkState channel) const noexcept;

  [[nodiscard]] std::string_view unit() const noexcept { return link_->unit(); }
  /// Returns from a hang-up.
  [[nodiscard]] std::uint32_t reconnects() const noexcept { return reconnects_; }

 private:
  std::unique_ptr<ByteLink> link_;
  BaudSearch search_;
  LinkPhase phase_ = LinkPhase::kReconnecting;
  bool was_open_ = false;
  bool away_ = false;         ///< Hung up since it was open.
  bool baud_wanted_ = false;  ///< The link is to be opened at search_.baud().
  std::uint32_t reconnects_ = 0;
};

}  // namespace fulcrum::handle_bridge
