#include "services/transport/bus/dds/far_participant.h"

#include <arpa/inet.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <vector>

#include "services/base/core/error.h"
#include "services/transport/bus/dds/chained_transport.h"
#include "services/transport/bus/dds/library.h"
#include "services/transport/bus/dds/peer_watch.h"
#include "services/transport/bus/dds/security.h"
#include "services/transport/bus/schema.h"

namespace fulcrum::bus {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;
using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

// A cable that is reconnected within the lease needs no new connection. services/transport/link makes a new participant
// after a longer silence, so a longer lease would only keep dead ones.
const Duration_t kFarLease{5, 0};
const Duration_t kFarAnnouncement{0, 200 * kMilli_ns};
const Duration_t kFarMaxBlocking{0, 5 * kMilli_ns};
// With the library's period of 3 s, the loss of a last packet would be detected only after that time.
const Duration_t kHeartbeat{0, 20 * kMilli_ns};
const Duration_t kResponse{0, 1 * kMilli_ns};
constexpr std::uint32_t kFarSocketBuffer_B = 4u << 20;
/// Payload of UDP in an Ethernet frame: a lost frame then costs one fragment and not a datagram of forty frames.
constexpr std::uint32_t kLargestDatagram_B = 1472;
/// A handshake carries certificate and signed permissions in one message, which the library cannot divide.
constexpr std::uint32_t kLargestSecuredDatagram_B = 16 * 1024;
/// Per millisecond and datagram. 12 MB/s are more than a scene is fetched with (kMostPieces in
/// services/transport/link).
constexpr std::int32_t kMostPackedFar_B = 12 * 1024;
constexpr int kStreamBurst = 1024;  ///< Packets that may wait for the reader.
constexpr std::uint32_t kEncapsulation_B = 4, kMostPadding_B = 3;

/// A packet that is being written.
struct Packet {
  std::span<const std::uint8_t> bytes;
};

std::uint32_t PaddingOf(std::span<const std::uint8_t> bytes) { return static_cast<std::uint32_t>(-bytes.size() & 3u); }
std::uint32_t SizeOf(std::span<const std::uint8_t> bytes) {
  return kEncapsulation_B + static_cast<std::uint32_t>(bytes.size()) + PaddingOf(bytes);
}

/// Type of plain bytes, written from a Packet and read into a vector.
class PacketType final : public fast::TopicDataType {
 public:
  PacketType(const char* name, std::uint32_t largest_B) {
    setName(name);
    m_typeSize = largest_B + kEncapsulation_B + kMostPadding_B;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const std::span<const std::uint8_t> bytes = static_cast<const Packet*>(data)->bytes;
    // RTPS pads a sample to a multiple of four bytes, but not a sample in fragments. Therefore it is padded here, and
    // the number of bytes is stored in the options (as in XTypes 1.2, 7.6.2.1.2).
    const std::uint32_t padding = PaddingOf(bytes);
    if (payload->max_size < SizeOf(bytes)) return false;
    const std::array<std::uint8_t, kEncapsulation_B> head{0, 1, 0, static_cast<std::uint8_t>(padding)};
    std::memcpy(payload->data, head.data(), head.size());
    std::memcpy(payload->data + head.size(), bytes.data(), bytes.size());
    std::memset(payload->data + head.size() + bytes.size(), 0, padding);
    payload->length = SizeOf(bytes);
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    auto* bytes = static_cast<std::vector<std::uint8_t>*>(data);
    const std::uint32_t padding = payload->length > kEncapsulation_B ? payload->data[kEncapsulation_B - 1] & 3u : 0;
    const bool whole = payload->length >= kEncapsulation_B + padding;
    bytes->assign(payload->data + (whole ? kEncapsulation_B : 0),
                  payload->data + (whole ? payload->length - padding : 0));
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    const std::uint32_t size = SizeOf(static_cast<const Packet*>(data)->bytes);
    return [size] { return size; };
  }
  void* createData() override { return new std::vector<std::uint8_t>(); }
  void deleteData(void* data) override { delete static_cast<std::vector<std::uint8_t>*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

bool IsAddress(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

constexpr const char* kCartEnd = "link of the cart";
constexpr const char* kHostEnd = "link of the other host";
const char* NameOf(FarSide side) { return side == FarSide::kCart ? kCartEnd : kHostEnd; }

/// Between hosts security always includes encryption.
Security SecurityOf(const FarSettings& settings) {
  return {settings.keys, std::string(kLinkIdentity), !settings.keys.empty()};
}

fast::DomainParticipantQos QosOf(const FarSettings& settings, std::shared_ptr<dds::StrangeAddresses> strangers) {
  fast::DomainParticipantQos qos;
  qos.name(NameOf(settings.side));
  const std::string user_data = dds::UserDataOf(NameOf(settings.side), SchemaHash(), 0);
  qos.user_data().data_vec({user_data.begin(), user_data.end()});
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {settings.address};
  udp->sendBufferSize = kFarSocketBuffer_B;
  udp->receiveBufferSize = kFarSocketBuffer_B;
  udp->maxMessageSize = settings.keys.empty() ? kLargestDatagram_B : kLargestSecuredDatagram_B;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(dds::OnlyWith(settings.peer, std::move(udp), std::move(strangers)));
  qos.wire_protocol().builtin.discovery_config.leaseDuration = kFarLease;
  qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod = kFarAnnouncement;
  // Fixed, so that the peer knows them and announces itself to one port only. Automatic ids grow with each participant
  // of a process, also with one that is made again, and begin at 0.
  constexpr int kCartId = 100, kHostId = 101;
  const bool cart = settings.side == FarSide::kCart;
  qos.wire_protocol().participant_id = cart ? kCartId : kHostId;
  rtps::Locator_t peer;
  peer.kind = LOCATOR_KIND_UDPv4;
  rtps::IPLocator::setIPv4(peer, settings.peer);
  // RTPS 2.3, 9.6.1.1: PB + DG * domain + d1 + PG * id.
  peer.port = static_cast<std::uint32_t>(7400 + 250 * settings.domain + 10 + 2 * (cart ? kHostId : kCartId));
  qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  dds::BoundPacking(kMostPackedFar_B, &qos);
  if (!settings.keys.empty()) {
    // Open from the start: a participant that is made while the cable is cut would otherwise begin with what its peer
    // has sent to its predecessor. With one peer, a handshake that is repeated costs a second.
    dds::ApplySecurity(SecurityOf(settings), &qos)->Open();
  }
  return qos;
}

template <class Qos>
void ApplyLane(FarLane lane, int depth, Qos* qos) {
  const bool ordered = lane == FarLane::kOrdered;
  qos->reliability().kind = ordered ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
  qos->reliability().max_blocking_time = kFarMaxBlocking;
  qos->durability().kind = fast::VOLATILE_DURABILITY_QOS;
  qos->history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos->history().depth = depth;
  qos->resource_limits().max_instances = 1;
  qos->resource_limits().max_samples = depth + 1;
  qos->resource_limits().max_samples_per_instance = depth + 1;
  qos->resource_limits().allocated_samples = 0;
  qos->endpoint().history_memory_policy = ordered ? rtps::DYNAMIC_REUSABLE_MEMORY_MODE : rtps::PREALLOCATED_MEMORY_MODE;
  qos->data_sharing().off();
}

/// One lane, both ways. Each side writes topics of its own, so that no side receives its own packets.
class Lane final : private fast::DataReaderListener, private fast::DataWriterListener {
 public:
  Lane(FarLane lane, FarSide side, fast::DomainParticipant* participant, fast::Publisher* publisher,
       fast::Subscriber* subscriber, const FarSink& sink)
      : lane_(lane), sink_(sink), publisher_(publisher), subscriber_(subscriber) {
    const bool ordered = lane == FarLane::kOrdered;
    largest_B_ = ordered ? kOrderedPacket_B : kStreamPacket_B;
    fast::TypeSupport type(new PacketType(ordered ? "fulcrum/OrderedPacket" : "fulcrum/StreamPacket",
                                          static_cast<std::uint32_t>(largest_B_)));
    type.register_type(participant);
    const auto topic = [&](bool from_cart) {
      const std::size_t name = (ordered ? 2u : 0u) + (from_cart ? 0u : 1u);
      return participant->create_topic(std::string(kLinkTopics.at(name)), type.get_type_name(),
                                       fast::TOPIC_QOS_DEFAULT);
    };
    fast::Topic* out = topic(side == FarSide::kCart);
    fast::Topic* in = topic(side != FarSide::kCart);
    if (out == nullptr || in == nullptr) throw InputError("cannot make the topics of the link");

    fast::DataWriterQos writer_qos;
    ApplyLane(lane, ordered ? kOrderedBacklog : 1, &writer_qos);
    writer_qos.publish_mode().kind = ordered ? fast::ASYNCHRONOUS_PUBLISH_MODE : fast::SYNCHRONOUS_PUBLISH_MODE;
    if (ordered) writer_qos.publish_mode().flow_controller_name = dds::kPacking;
    writer_qos.reliable_writer_qos().times.heartbeatPeriod = kHeartbeat;
    writer_qos.reliable_writer_qos().times.nackResponseDelay = kResponse;
    writer_ = publisher->create_datawriter(out, writer_qos, this, fast::StatusMask::publication_matched());
    fast::DataReaderQos reader_qos;
    ApplyLane(lane, ordered ? kOrderedBacklog : kStreamBurst, &reader_qos);
    reader_qos.reliable_reader_qos().times.heartbeatResponseDelay = kResponse;
    reader_ = subscriber->create_datareader(in, reader_qos, this, fast::StatusMask::data_available());
    if (writer_ == nullptr || reader_ == nullptr) throw InputError("cannot make the ports of the link");
  }
  ~Lane() override {
    // The listeners are not called from here on.
    if (writer_ != nullptr) writer_->set_listener(nullptr);
    if (reader_ != nullptr) reader_->set_listener(nullptr);
    if (writer_ != nullptr) publisher_->delete_datawriter(writer_);
    if (reader_ != nullptr) subscriber_->delete_datareader(reader_);
  }
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;

  bool Send(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() > largest_B_ || !matched()) return false;
    try {
      Packet packet{bytes};
      return writer_->write(&packet);
    } catch (...) {
      return false;
    }
  }
  [[nodiscard]] bool matched() const noexcept {
    return readers_.load(std::memory_order_relaxed) > 0;  // Relaxed: an independent value that orders nothing.
  }

 private:
  void on_publication_matched(fast::DataWriter*, const fast::PublicationMatchedStatus& status) override {
    readers_.store(status.current_count, std::memory_order_relaxed);
  }
  void on_data_available(fast::DataReader* reader) override {
    try {
      fast::SampleInfo info;
      while (reader->take_next_sample(&received_, &info) == ReturnCode::RETCODE_OK) {
        if (info.valid_data) sink_(lane_, received_);
      }
    } catch (...) {
      // The packet counts as lost.
    }
  }

  const FarLane lane_;
  const FarSink& sink_;
  fast::Publisher* publisher_;
  fast::Subscriber* subscriber_;
  std::size_t largest_B_ = 0;
  fast::DataWriter* writer_ = nullptr;
  fast::DataReader* reader_ = nullptr;
  std::atomic<int> readers_{0};
  std::vector<std::uint8_t> received_;
};

}  // namespace

struct FarParticipant::Impl {
  Impl(const FarSettings& settings, FarSink far_sink)
      : sink(std::move(far_sink)), watch(NameOf(settings.side), SchemaHash(), SecurityOf(settings), 0, kCartEnd) {
    if (settings.domain < kFirstLinkDomain || settings.domain > kLastLinkDomain) {
      throw InputError("link domain " + std::to_string(settings.domain) + " is out of range: 101 to 200");
    }
    for (const std::string& address : {settings.address, settings.peer}) {
      if (!IsAddress(address)) throw InputError("\"" + address + "\" is no IPv4 address; valid: as in 192.168.1.20");
    }
    dds::PrepareLibrary();
    participant = fast::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<std::uint32_t>(settings.domain), QosOf(settings, strangers), &watch, fast::StatusMask::none());
    if (participant == nullptr) {
      throw InputError("cannot open the link on " + settings.address +
                       ": is that an address of this machine, and are its UDP ports of link domain " +
                       std::to_string(settings.domain) + " free?");
    }
    fast::Publisher* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    fast::Subscriber* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    stream = std::make_unique<Lane>(FarLane::kStream, settings.side, participant, publisher, subscriber, sink);
    ordered = std::make_unique<Lane>(FarLane::kOrdered, settings.side, participant, publisher, subscriber, sink);
  }
  ~Impl() {
    if (participant == nullptr) return;
    participant->set_listener(nullptr);
    stream.reset();
    ordered.reset();
    participant->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  const FarSink sink;
  const std::shared_ptr<dds::StrangeAddresses> strangers = std::make_shared<dds::StrangeAddresses>();
  dds::PeerWatch watch;
  fast::DomainParticipant* participant = nullptr;
  std::unique_ptr<Lane> stream, ordered;
};

FarParticipant::FarParticipant(const FarSettings& settings, FarSink sink)
    : impl_(std::make_unique<Impl>(settings, std::move(sink))) {}
FarParticipant::~FarParticipant() = default;

bool FarParticipant::Send(FarLane lane, std::span<const std::uint8_t> packet) noexcept {
  return (lane == FarLane::kStream ? impl_->stream : impl_->ordered)->Send(packet);
}

bool FarParticipant::matched() const noexcept { return impl_->stream->matched() && impl_->ordered->matched(); }

std::string FarParticipant::mismatch() { return impl_->watch.mismatch(); }
std::uint64_t FarParticipant::dropped() const noexcept { return impl_->strangers->datagrams(); }
Refusals FarParticipant::refusals() {
  Refusals all = impl_->watch.refusals();
  for (const std::string& address : impl_->strangers->named()) {
    ++all.participants;
    all.texts.push_back("datagrams of the link from " + address + ", which is not its peer");
  }
  return all;
}

bool IsUnplugged(const std::string& address) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return false;  // Not known.
  bool unplugged = false;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text.data(), text.size());
    constexpr unsigned kBoth = IFF_UP | IFF_RUNNING;
    unplugged = unplugged || (address == text.data() && (one->ifa_flags & kBoth) != kBoth);
  }
  freeifaddrs(all);
  return unplugged;
}

std::string ResolveAddress(const std::string& name) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(name.c_str(), nullptr, &hints, &found);
  if (error != 0) {
    throw InputError("\"" + name + "\": has no IPv4 address: " + gai_strerror(error) +
                     "; valid: an address as in 192.168.1.20, or the name of a host");
  }
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr, text.data(), text.size());
  freeaddrinfo(found);
  return text.data();
}

std::string AddressTowards(const std::string& peer) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(9);  // Any port: nothing is sent.
  inet_pton(AF_INET, peer.c_str(), &to.sin_addr);
  sockaddr_in from{};
  socklen_t length = sizeof from;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool found = fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
                     getsockname(fd, reinterpret_cast<sockaddr*>(&from), &length) == 0;
  const int why = errno;
  if (fd >= 0) close(fd);
  if (!found) {
    throw InputError(peer + ": no route to this address: " + std::strerror(why) +
                     "; is the cable connected, and does this machine have an address in that network?");
  }
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &from.sin_addr, text.data(), text.size());
  return text.data();
}

}  // namespace fulcrum::bus
