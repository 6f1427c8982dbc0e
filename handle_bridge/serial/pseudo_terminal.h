// A pseudo-terminal as a serial cable between simulated firmware and the bridge. libserialport cannot open one by name
// (it searches /sys/class/tty), so the bridge's end is read through termios, with the same speed and framing.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "handle_bridge/serial/byte_source.h"
#include "services/base/runtime/file_descriptor.h"

namespace fulcrum::handle_bridge {

/// The firmware's end. Its destruction acts like unplugging: the reader gets a hang-up.
class PseudoTerminal {
 public:
  /// Throws std::system_error if the system has no pseudo-terminal left.
  PseudoTerminal();
  /// Device that the reader opens, for example "/dev/pts/7".
  [[nodiscard]] const std::string& device() const { return device_; }
  /// Sends without waiting; bytes that do not fit into the buffer are lost, as on a wire. Returns the number of bytes
  /// sent.
  std::size_t Send(std::string_view bytes) noexcept;
  /// Speed that the reader has set [baud]; 0 if it cannot be determined.
  [[nodiscard]] int ReaderBaud() const noexcept;

 private:
  runtime::FileDescriptor master_;
  std::string device_;
};

/// The bridge's end: opens the device whose name `device` returns (empty: unplugged), raw, 8N1.
class TerminalOpener final : public ByteSourceOpener {
 public:
  /// @param unit serial number of the simulated unit.
  TerminalOpener(std::function<std::string()> device, std::string unit)
      : device_(std::move(device)), unit_(std::move(unit)) {}
  std::unique_ptr<ByteSource> Open(int baud) override;

 private:
  std::function<std::string()> device_;
  std::string unit_;
};

}  // namespace fulcrum::handle_bridge
