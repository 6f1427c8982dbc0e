#include "handle_bridge/serial/serial_port.h"

#include <libserialport.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace fulcrum::handle_bridge {
namespace {

struct FreePort {
  void operator()(sp_port* port) const {
    sp_close(port);
    sp_free_port(port);
  }
};
using Port = std::unique_ptr<sp_port, FreePort>;

class SerialPortSource final : public ByteSource {
 public:
  SerialPortSource(Port port, std::string unit) : port_(std::move(port)), unit_(std::move(unit)) {}

  ReadResult Read(std::span<char> buffer) noexcept override {
    // After a hang-up sp_nonblocking_read() returns 0, the same as without data; sp_input_waiting() fails with EIO.
    const int waiting = sp_input_waiting(port_.get());
    if (waiting < 0) {
      return {0, true};
    }
    const std::size_t count = std::min(static_cast<std::size_t>(waiting), buffer.size());
    const int read = count > 0 ? sp_nonblocking_read(port_.get(), buffer.data(), count) : 0;
    return {static_cast<std::size_t>(std::max(read, 0)), read < 0};
  }

  [[nodiscard]] std::string_view unit() const noexcept override { return unit_; }

 private:
  Port port_;
  std::string unit_;
};

bool HasIdentity(const sp_port* port, const config::SerialLink& link) {
  int vendor = 0;
  int product = 0;
  if (sp_get_port_usb_vid_pid(port, &vendor, &product) != SP_OK || vendor != link.usb_vendor_id ||
      product != link.usb_product_id) {
    return false;
  }
  const char* serial = sp_get_port_usb_serial(port);
  return link.usb_serial.empty() || (serial && link.usb_serial == serial);
}

Port FindByIdentity(const config::SerialLink& link) {
  sp_port** list = nullptr;
  if (link.usb_vendor_id == 0 || sp_list_ports(&list) != SP_OK) {
    return nullptr;
  }
  sp_port* copy = nullptr;
  for (sp_port** port = list; *port && !copy; ++port) {
    if (HasIdentity(*port, link) && sp_copy_port(*port, &copy) != SP_OK) {
      copy = nullptr;
    }
  }
  sp_free_port_list(list);
  return Port(copy);
}

Port FindByName(const config::SerialLink& link) {
  if (link.port.empty()) {
    return nullptr;
  }
  // libserialport searches a name in /sys/class/tty, which contains no by-path links.
  std::error_code error;
  const std::filesystem::path device = std::filesystem::canonical(link.port, error);
  sp_port* port = nullptr;
  if (error || sp_get_port_by_name(device.c_str(), &port) != SP_OK) {
    return nullptr;
  }
  return Port(port);
}

Port Find(const config::SerialLink& link) {
  Port port = FindByIdentity(link);
  return port ? std::move(port) : FindByName(link);
}

}  // namespace

std::string PortOf(const config::SerialLink& link) {
  const Port port = Find(link);
  const char* name = port ? sp_get_port_name(port.get()) : nullptr;
  return name != nullptr ? name : "";
}

std::unique_ptr<ByteSource> SerialPortOpener::Open(int baud) {
  Port port = Find(link_);
  if (!port || sp_open(port.get(), SP_MODE_READ) != SP_OK) {
    return nullptr;
  }
  const bool set_up = sp_set_baudrate(port.get(), baud) == SP_OK && sp_set_bits(port.get(), 8) == SP_OK &&
                      sp_set_parity(port.get(), SP_PARITY_NONE) == SP_OK && sp_set_stopbits(port.get(), 1) == SP_OK &&
                      sp_set_flowcontrol(port.get(), SP_FLOWCONTROL_NONE) == SP_OK &&
                      sp_flush(port.get(), SP_BUF_INPUT) == SP_OK;
  if (!set_up) {
    return nullptr;
  }
  const char* serial = sp_get_port_usb_serial(port.get());
  const char* name = sp_get_port_name(port.get());
  std::string unit = serial ? serial : !link_.port.empty() ? link_.port : name ? name : "";
  return std::make_unique<SerialPortSource>(std::move(port), std::move(unit));
}

}  // namespace fulcrum::handle_bridge
