// A link that reconnects automatically: a separate thread opens and closes it, reading never waits.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string_view>
#include <thread>

#include "handle_bridge/serial/byte_source.h"

namespace fulcrum::handle_bridge {

enum class LinkPhase : std::uint8_t {
  kReconnecting,  ///< The port has not been found (yet).
  kOpen,
  kLost,  ///< The other end has hung up.
};

/// Interface of a link for the node.
class ByteLink {
 public:
  virtual ~ByteLink() = default;
  struct Result {
    std::size_t bytes = 0;
    LinkPhase phase = LinkPhase::kReconnecting;
    /// The connection is new since the last call; incomplete data of the old one must be discarded.
    bool fresh = false;
  };
  /// Cyclic thread; never waits.
  virtual Result Read(std::span<char> buffer) noexcept = 0;
  /// Serial number of the connected unit; empty without a connection. Cyclic thread.
  [[nodiscard]] virtual std::string_view unit() const noexcept = 0;
  /// Requests to reopen the link at another speed. Cyclic thread; returns false if it must be retried.
  virtual bool SetBaud(int baud) noexcept = 0;
};

class ReconnectingLink final : public ByteLink {
 public:
  /// Period of the search for a missing port.
  static constexpr int kRetry_ms = 250;

  ReconnectingLink(std::unique_ptr<ByteSourceOpener> opener, int baud);
  ~ReconnectingLink() override;

  Result Read(std::span<char> buffer) noexcept override;
  [[nodiscard]] std::string_view unit() const noexcept override {
    return current_ ? current_->unit() : std::string_view();
  }
  bool SetBaud(int baud) noexcept override;

 private:
  void Connect(const std::stop_token& stop);

  std::unique_ptr<ByteSourceOpener> opener_;  // Used by the thread only.
  std::unique_ptr<ByteSource> current_;       // Used by the reader only.
  LinkPhase phase_ = LinkPhase::kReconnecting;

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::unique_ptr<ByteSource> fresh_;  // Guarded by mutex_: opened, not yet taken by the reader.
  std::unique_ptr<ByteSource> dead_;   // Guarded: hung up, to be closed by the thread.
  int baud_;                           // Guarded.
  bool wanted_ = true;                 // Guarded: the reader has no connection.
  bool searched_ = false;              // Guarded: at least one attempt has failed since the hang-up.
  std::jthread thread_;                // Last member: stopped and joined before the others are destroyed.
};

}  // namespace fulcrum::handle_bridge
