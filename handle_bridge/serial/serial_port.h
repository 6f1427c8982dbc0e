// Real serial ports through libserialport.
#pragma once

#include <memory>
#include <string>

#include "handle_bridge/serial/byte_source.h"
#include "services/base/config/cart.h"

namespace fulcrum::handle_bridge {

/// Device file of the port that SerialPortOpener would open; empty: it is not there.
[[nodiscard]] std::string PortOf(const config::SerialLink& link);

/// Opens a port for reading, 8N1 without flow control. The port is selected by USB identity if one is given, otherwise
/// by name or by-path link. Its unit is the adapter's USB serial number, or the name of the port if there is none.
class SerialPortOpener final : public ByteSourceOpener {
 public:
  explicit SerialPortOpener(config::SerialLink link) : link_(std::move(link)) {}
  std::unique_ptr<ByteSource> Open(int baud) override;

 private:
  config::SerialLink link_;
};

}  // namespace fulcrum::handle_bridge
