// Real serial ports through libserialport.
#pragma once

#include <memory>
#include <string>

#include "handle_bridge/serial/byte_source.h"
#include "services/base/config/cart.h"

namespace fulcrum::handle_bridge {

/// Opens 8N1 without flow control, for reading. The port is the one with the USB identity given, else the one given by
/// name or by-path link. Its unit is the adapter's USB serial number, without one the name of the port.
class SerialPortOpener final : public ByteSourceOpener {
 public:
  explicit SerialPortOpener(config::SerialLink link) : link_(std::move(link)) {}
  std::unique_ptr<ByteSource> Open(int baud) override;

 private:
  config::SerialLink link_;
};

}  // namespace fulcrum::handle_bridge
