#include "services/transport/bus/dds/chained_transport.h"

#include <arpa/inet.h>
#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fastdds/rtps/common/LocatorList.hpp>
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

using Ipv4 = StrangeAddresses::Ipv4;

Ipv4 AddressOf(const rtps::Locator_t& locator) {
  Ipv4 address{};
  std::copy_n(rtps::IPLocator::getIPv4(locator), address.size(), address.begin());
  return address;
}

class OnlyWithTransport final : public ChainedTransport {
 public:
  OnlyWithTransport(const transport::ChainingTransportDescriptor& descriptor, const Ipv4& peer,
                    std::shared_ptr<StrangeAddresses> strangers)
      : ChainedTransport(descriptor), peer_(peer), strangers_(std::move(strangers)) {}

  void receive(transport::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    const Ipv4 from = AddressOf(remote);
    if (from != peer_) return strangers_->Add(from);
    above->OnDataReceived(data, size, local, remote);
  }

  bool send(rtps::SenderResource* below, const rtps::octet* data, std::uint32_t size, rtps::LocatorsIterator* begin,
            rtps::LocatorsIterator* end, const std::chrono::steady_clock::time_point& limit) override {
    std::vector<rtps::Locator_t> to;
    for (; *begin != *end; ++*begin) {
      if (AddressOf(**begin) == peer_) to.push_back(**begin);
    }
    if (to.empty()) return true;
    transport::Locators first(to.cbegin()), last(to.cend());
    return below->send(data, size, &first, &last, limit);
  }

 private:
  const Ipv4 peer_;
  const std::shared_ptr<StrangeAddresses> strangers_;
};

struct OnlyWithTransportDescriptor final : transport::ChainingTransportDescriptor {
  OnlyWithTransportDescriptor(std::shared_ptr<transport::TransportDescriptorInterface> below, const Ipv4& with,
                              std::shared_ptr<StrangeAddresses> others)
      : ChainingTransportDescriptor(std::move(below)), peer(with), strangers(std::move(others)) {}

  [[nodiscard]] transport::TransportInterface* create_transport() const override {
    return new OnlyWithTransport(*this, peer, strangers);
  }

  const Ipv4 peer;
  const std::shared_ptr<StrangeAddresses> strangers;
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

void StrangeAddresses::Add(const Ipv4& ipv4) {
  datagrams_.fetch_add(1, std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  if (named_.size() < kMostNamed && std::ranges::find(named_, ipv4) == named_.end()) named_.push_back(ipv4);
}

std::vector<std::string> StrangeAddresses::named() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> texts;
  for (const Ipv4& address : named_) {
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, address.data(), text.data(), text.size());
    texts.emplace_back(text.data());
  }
  return texts;
}

std::shared_ptr<transport::TransportDescriptorInterface> OnlyWith(
    const std::string& peer, std::shared_ptr<transport::TransportDescriptorInterface> transport,
    std::shared_ptr<StrangeAddresses> strangers) {
  Ipv4 address{};
  inet_pton(AF_INET, peer.c_str(), address.data());
  return std::make_shared<OnlyWithTransportDescriptor>(std::move(transport), address, std::move(strangers));
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
