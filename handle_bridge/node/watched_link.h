// A link together with its state for the node: baud rate, number of reconnections, fault.
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
  /// @param baud baud rate of the cart file.
  WatchedLink(std::unique_ptr<ByteLink> link, int baud) : link_(std::move(link)), search_(baud) {}

  ByteLink::Result Read(std::span<char> buffer) noexcept;
  /// Evaluates the lines that Read() of an open link has returned.
  void Evaluate(const LinkCounts& counts, double dt_s) noexcept;
  /// State of the link. `channel` is the state that follows from the received lines alone while the link is open.
  [[nodiscard]] LinkState state(LinkState channel) const noexcept;

  [[nodiscard]] std::string_view unit() const noexcept { return link_->unit(); }
  /// Number of reconnections after a hang-up.
  [[nodiscard]] std::uint32_t reconnects() const noexcept { return reconnects_; }

 private:
  std::unique_ptr<ByteLink> link_;
  BaudSearch search_;
  LinkPhase phase_ = LinkPhase::kReconnecting;
  bool was_open_ = false;
  bool hung_up_ = false;      ///< Hung up since it was last open.
  bool baud_wanted_ = false;  ///< The link must be reopened at search_.baud().
  std::uint32_t reconnects_ = 0;
};

}  // namespace fulcrum::handle_bridge
