#include "services/transport/bus/dds/chained_transport.h"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <chrono>
#include <cstdint>
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
  SerialTransport(const transport::ChainingTransportDescriptor& descriptor, std::shared_ptr<DiscoveryGate> gate)
      : ChainedTransport(descriptor), gate_(std::move(gate)) {}

  void receive(transport::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    if (IsDiscovery(local)) {
      gate_->Pass(above, data, size, local, remote);
    } else {
      above->OnDataReceived(data, size, local, remote);
    }
  }

 private:
  const std::shared_ptr<DiscoveryGate> gate_;
};

struct SerialTransportDescriptor final : transport::ChainingTransportDescriptor {
  SerialTransportDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> below,
                            std::shared_ptr<DiscoveryGate> with)
      : ChainingTransportDescriptor(std::move(below)), gate(std::move(with)) {}

  [[nodiscard]] transport::TransportInterface* create_transport() const override {
    return new SerialTransport(*this, gate);
  }

  const std::shared_ptr<DiscoveryGate> gate;
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

void DiscoveryGate::Pass(transport::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
                         const rtps::Locator_t& local, const rtps::Locator_t& remote) {
  const std::lock_guard lock(mutex_);
  if (open_) {
    above->OnDataReceived(data, size, local, remote);
  } else if (held_.size() < kMostHeld) {
    held_.push_back({above, {data, data + size}, local, remote});
  }
}

void DiscoveryGate::Open() {
  const std::lock_guard lock(mutex_);
  open_ = true;
  for (const Held& held : held_) {
    held.above->OnDataReceived(held.datagram.data(), static_cast<std::uint32_t>(held.datagram.size()), held.local,
                               held.remote);
  }
  held_.clear();
}

std::shared_ptr<transport::TransportDescriptorInterface> OneDiscoveryAtATime(
    std::shared_ptr<transport::TransportDescriptorInterface> transport, std::shared_ptr<DiscoveryGate> gate) {
  return std::make_shared<SerialTransportDescriptor>(std::move(transport), std::move(gate));
}

std::shared_ptr<transport::TransportDescriptorInterface> LetGather(
    std::shared_ptr<transport::TransportDescriptorInterface> transport, std::shared_ptr<Gathering> gathering) {
  return std::make_shared<GatheringTransportDescriptor>(std::move(transport), std::move(gathering));
}

}  // namespace fulcrum::bus::dds
