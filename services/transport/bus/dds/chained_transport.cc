#include "services/transport/bus/dds/chained_transport.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <thread>
#include <utility>

namespace fulcrum::bus::dds {
namespace {

namespace transport = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;

/// Whether the port is one of discovery. RTPS 2.2, 9.6.1.1, with the default port parameters: the well-known ports of
/// discovery are even (7400 + 250 domain + 0 by multicast, + 10 + 2 participant by unicast), those of user data odd.
bool IsDiscovery(const rtps::Locator_t& local) { return local.port % 2 == 0; }

/// How long small samples gather in a socket. The smallest buffer in use (Debian's default) holds thirty times as much.
constexpr std::chrono::milliseconds kRest(8);

/// Sends every datagram unchanged to its destination.
class ChainedTransport : public transport::ChainingTransport {
 public:
  explicit ChainedTransport(const transport::ChainingTransportDescriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor.low_level_descriptor) {}

  transport::TransportDescriptorInterface* get_configuration() override { return descriptor_.get(); }

  bool send(rtps::SenderResource* below, const rtps::octet* data, std::uint32_t size, rtps::LocatorsIterator* begin,
            rtps::LocatorsIterator* end, const std::chrono::steady_clock::time_point& limit) override {
    return below->send(data, size, begin, end, limit);
  }

 private:
  const std::shared_ptr<transport::TransportDescriptorInterface> descriptor_;
};

class SerialTransport final : public ChainedTransport {
 public:
  using ChainedTransport::ChainedTransport;

  void receive(transport::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    std::unique_lock lock(discovery_, std::defer_lock);
    if (IsDiscovery(local)) lock.lock();
    above->OnDataReceived(data, size, local, remote);
  }

 private:
  std::mutex discovery_;
};

struct SerialTransportDescriptor final : transport::ChainingTransportDescriptor {
  using ChainingTransportDescriptor::ChainingTransportDescriptor;

  [[nodiscard]] transport::TransportInterface* create_transport() const override { return new SerialTransport(*this); }
};

class GatheringTransport final : public ChainedTransport {
 public:
  GatheringTransport(const transport::ChainingTransportDescriptor& descriptor, std::shared_ptr<Gathering> gathering)
      : ChainedTransport(descriptor), gathering_(std::move(gathering)) {}

  void receive(transport::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    above->OnDataReceived(data, size, local, remote);
    if (!IsDiscovery(local) && gathering_->caught_up.exchange(false)) std::this_thread::sleep_for(kRest);
  }

 private:
  const std::shared_ptr<Gathering> gathering_;
};

struct GatheringTransportDescriptor final : transport::ChainingTransportDescriptor {
  GatheringTransportDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> below,
                               std::shared_ptr<Gathering> with)
      : ChainingTransportDescriptor(std::move(below)), gathering(std::move(with)) {}

  [[nodiscard]] transport::TransportInterface* create_transport() const override {
    return new GatheringTransport(*this, gathering);
  }

  const std::shared_ptr<Gathering> gathering;
};

}  // namespace

std::shared_ptr<transport::TransportDescriptorInterface> OneDiscoveryAtATime(
    std::shared_ptr<transport::TransportDescriptorInterface> transport) {
  return std::make_shared<SerialTransportDescriptor>(std::move(transport));
}

std::shared_ptr<transport::TransportDescriptorInterface> LetGather(
    std::shared_ptr<transport::TransportDescriptorInterface> transport, std::shared_ptr<Gathering> gathering) {
  return std::make_shared<GatheringTransportDescriptor>(std::move(transport), std::move(gathering));
}

}  // namespace fulcrum::bus::dds
