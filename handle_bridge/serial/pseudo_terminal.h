// A pseudo-terminal as a serial cable between simulated firmware and the bridge. libserialport refuses one by name (it
// looks in /sys/class/tty), so its near end is read through termios, with the same speed and framing.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "handle_bridge/serial/byte_source.h"
#include "handle_bridge/serial/file_descriptor.h"

namespace fulcrum::handle_bridge {

/// The firmware's end. Destroying it is pulling the plug: the reader sees a hang-up.
class PseudoTerminal {
 public:
  /// Throws std::system_error when the system has none left.
  PseudoTerminal();
  /// Device that the reader opens, "/dev/pts/7".
  [[nodiscard]] const std::string& device() const { return device_; }
  /// Sends without waiting; what does not fit is lost, as on a wire. Returns bytes sent.
  std::size_t Send(std::string_view bytes) noexcept;
  /// Speed that the reader has set [baud]; 0 when it cannot be told.
  [[nodiscard]] int ReaderBaud() const noexcept;

 private:
  FileDescriptor master_;
  std::string device_;
};

/// The bridge's end: opens raw 8N1 the device that `device` names at that moment (empty: unplugged).
class TerminalOpener final : public ByteSourceOpener {
 public:
  /// @param unit serial number of the unit behind it.
  TerminalOpener(std::function<std::string()> device, std::string unit)
      : device_(std::move(device)), unit_(std::move(unit)) {}
  std::unique_ptr<ByteSource> Open(int baud) override;

 private:
  std::function<std::string()> device_;
  std::string unit_;
};

}  // namespace fulcrum::handle_bridge
