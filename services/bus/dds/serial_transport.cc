#include "services/bus/dds/serial_transport.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <utility>

namespace fulcrum::bus::dds {
namespace {

namespace transport = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;

/// RTPS 2.2, 9.6.1.1, with the default port parameters: the well-known ports of discovery are even (7400 + 250 domain
/// + 0 by multicast, + 10 + 2 participant by unicast), those of user data odd.
bool IsDiscovery(const rtps::Locator_t& local) { return local.port % 2 == 0; }

class SerialTransport : public transport::ChainingTransport {
 public:
  explicit SerialTransport(const transport::ChainingTransportDescriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor.low_level_descriptor) {}

  transport::TransportDescriptorInterface* get_configuration() override { return descriptor_.get(); }

  bool send(rtps::SenderResource* below, const rtps::octet* data, std::uint32_t size, rtps::LocatorsIterator* begin,
            rtps::LocatorsIterator* end, const std::chrono::steady_clock::time_point& limit) override {
    return below->send(data, size, begin, end, limit);
  }

  void receive(transport::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    std::unique_lock lock(discovery_, std::defer_lock);
    if (IsDiscovery(local)) lock.lock();
    above->OnDataReceived(data, size, local, remote);
  }

 private:
  const std::shared_ptr<transport::TransportDescriptorInterface> descriptor_;
  std::mutex discovery_;
};

struct SerialTransportDescriptor : transport::ChainingTransportDescriptor {
  using ChainingTransportDescriptor::ChainingTransportDescriptor;

  [[nodiscard]] transport::TransportInterface* create_transport() const override { return new SerialTransport(*this); }
};

}  // namespace

std::shared_ptr<transport::TransportDescriptorInterface> OneDiscoveryAtATime(
    std::shared_ptr<transport::TransportDescriptorInterface> transport) {
  return std::make_shared<SerialTransportDescriptor>(std::move(transport));
}

}  // namespace fulcrum::bus::dds
