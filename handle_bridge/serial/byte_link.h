// A link that comes back by itself: opening and closing happen on a thread of its own, reading never waits.
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
  kLost,  ///< Hung up just now.
};

/// What the node reads.
class ByteLink {
 public:
  virtual ~ByteLink() = default;
  struct Result {
    std::size_t bytes = 0;
    LinkPhase phase = LinkPhase::kReconnecting;
    bool fresh = false;  ///< The connection was made since the last call: what was half read before is void.
  };
  /// Cyclic thread; never waits.
  virtual Result Read(std::span<char> buffer) noexcept = 0;
  /// Serial number of the unit that is connected; empty when none is. Cyclic thread.
  [[nodiscard]] virtual std::string_view unit() const noexcept = 0;
  /// Opens the link anew at another speed. Cyclic thread; false: not now, ask again.
  virtual bool SetBaud(int baud) noexcept = 0;
};

class ReconnectingLink final : public ByteLink {
 public:
  /// How often a missing port is looked for.
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
  std::jthread thread_;                // Last: stopped and joined before the rest goes.
};

}  // namespace fulcrum::handle_bridge
