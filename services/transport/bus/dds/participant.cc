#include "services/transport/bus/dds/participant.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <mutex>
#include <sstream>

#include "services/base/core/error.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/abandoned_mutex.h"
#include "services/transport/bus/dds/audience.h"
#include "services/transport/bus/dds/chained_transport.h"
#include "services/transport/bus/dds/library.h"
#include "services/transport/bus/dds/peer_watch.h"
#include "services/transport/bus/dds/ports.h"
#include "services/transport/bus/dds/raw_reader.h"
#include "services/transport/bus/dds/security.h"
#include "services/transport/bus/dds/session_check.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/dds/socket_buffers.h"
#include "services/transport/bus/dds/sources.h"
#include "services/transport/bus/hex.h"

namespace fulcrum::bus {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;

/// A participant announces itself often while it is new and seldom afterwards: each announcement wakes two threads of
/// every other participant.
struct Announcing {
  std::uint32_t first_count;
  Duration_t first, later;
};
const Announcing kOpenAnnouncing{25, {0, 20 * kMilli_ns}, {0, 200 * kMilli_ns}};
/// With keys, each announcement of a participant that has not authenticated yet can start its handshake. The gate holds
/// the answers to the first one until the participant has been made; without a gate they can be lost, and a later
/// announcement has to replace them.
const Announcing kSecuredAnnouncing{50, {0, 100 * kMilli_ns}, {1, 0}};
/// Delay after which a reader requests the samples for late joiners; the first heartbeat may have come before the
/// match.
const Duration_t kFirstAcknack{0, 10 * kMilli_ns};
/// Period of the heartbeats of CauteryContact, whose history outlasts it; shorter than kLinger, so that a lost last
/// sample is repeated. The library sends one with each sample of a
/// full history, and each reader answers each heartbeat.
const Duration_t kStreamHeartbeat{0, 30 * kMilli_ns};
/// The period of a node is at least 10 ms wherever a reliable write can block.
const Duration_t kMaxBlocking{0, 5 * kMilli_ns};
/// Samples above this do not fit one UDP datagram and are sent in fragments.
constexpr std::uint32_t kDatagram_B = 64'000;
/// Per millisecond and datagram on an encrypted bus: twice what physics sends, and 5 kB below the largest datagram for
/// heartbeats and the codes of all receivers.
constexpr std::int32_t kMostPacked_B = 60'000;

fast::DomainParticipantQos ParticipantQos(const DdsSettings& settings, std::uint64_t schema_hash, std::uint64_t session,
                                          const std::shared_ptr<dds::Gathering>& gathering,
                                          std::shared_ptr<dds::DiscoveryGate>* gate) {
  fast::DomainParticipantQos qos;
  qos.name(settings.node_name);
  const std::string user_data = dds::UserDataOf(settings.node_name, schema_hash, session);
  qos.user_data().data_vec({user_data.begin(), user_data.end()});
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  udp->sendBufferSize = kSocketBuffer_B;
  udp->receiveBufferSize = kSocketBuffer_B;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  if (gathering) qos.transport().user_transports.back() = dds::LetGather(udp, gathering);
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = Duration_t(settings.lease_s, 0);
  const Announcing& announcing = settings.security.on() ? kSecuredAnnouncing : kOpenAnnouncing;
  discovery.initial_announcements = {announcing.first_count, announcing.first};
  discovery.leaseDuration_announcementperiod = announcing.later;
  if (settings.security.on()) *gate = dds::ApplySecurity(settings.security, &qos);
  if (settings.security.encrypt) dds::BoundPacking(kMostPacked_B, &qos);
  return qos;
}

/// Applies the settings that DataReaderQos and DataWriterQos have in common. `shared_memory` empty: no data-sharing.
template <class Qos>
void Apply(const Quality& quality, int depth, const std::string& shared_memory, Qos* qos) {
  qos->reliability().kind =
      quality.delivery == Delivery::kBestEffort ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
  qos->reliability().max_blocking_time = kMaxBlocking;
  qos->durability().kind =
      quality.late_joiners_served ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  qos->history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos->history().depth = depth;
  // The pool has this many samples of the type's full size: one more than the history, for the sample being written.
  // The library's default of 5000 would reserve gigabytes per large topic.
  const int samples = depth + 1;
  qos->resource_limits().max_instances = 1;
  qos->resource_limits().max_samples = samples;
  qos->resource_limits().max_samples_per_instance = samples;
  qos->resource_limits().allocated_samples = 0;
  qos->endpoint().history_memory_policy = rtps::PREALLOCATED_MEMORY_MODE;
  if (!shared_memory.empty()) {
    qos->data_sharing().on(shared_memory);
  } else {
    qos->data_sharing().off();
  }
}

}  // namespace

DdsSettings ToolSettings(int domain, std::string_view identity) {
  const std::filesystem::path memory = SharedMemoryDirectory(domain);
  return {.domain = domain,
          .node_name = std::string(kToolIdentity),
          .shared_memory = memory,
          .security = AnnouncedSecurity(memory, identity)};
}

namespace {

/// Number of the session: as set, else from the key folder of a guest, else as announced in the cart's directory.
std::uint64_t SessionOf(const DdsSettings& settings) {
  if (settings.session) return *settings.session;
  if (settings.security.on()) {
    if (const std::uint64_t handed_over = AnnouncedSession(settings.security.keys); handed_over != 0)
      return handed_over;
  }
  return AnnouncedSession(settings.shared_memory.empty() ? SharedMemoryDirectory(settings.domain)
                                                         : settings.shared_memory);
}

}  // namespace

struct DdsParticipant::Impl {
  Impl(const DdsSettings& settings, std::uint64_t hash)
      : schema_hash(hash),
        tissue_vertices(std::min<std::size_t>(settings.tissue_vertices, kMaxTissueVertices)),
        shared_memory(settings.shared_memory),
        security(settings.security),
        gathering(settings.gathers ? std::make_shared<dds::Gathering>() : nullptr),
        session{SessionOf(settings)},
        watch(settings.node_name, hash, settings.security, session.session) {
    if (settings.domain < kFirstCartDomain || settings.domain > kLastCartDomain) {
      throw InputError("domain " + std::to_string(settings.domain) + " is out of range: 1 to 100");
    }
    if (shared_memory.empty()) shared_memory = SharedMemoryDirectory(settings.domain);
    PrepareSharedMemory(shared_memory);
    dds::PrepareLibrary();

    std::shared_ptr<dds::DiscoveryGate> gate;
    participant = fast::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<std::uint32_t>(settings.domain), ParticipantQos(settings, hash, session.session, gathering, &gate),
        &watch, fast::StatusMask::none());
    if (participant == nullptr) {
      throw InputError("domain " + std::to_string(settings.domain) +
                       ": cannot open the bus; are its UDP ports on 127.0.0.1 free?");
    }
    dds::EnlargeReceiveBuffers();
    if (gate) gate->Open();
    if (security.on()) {
      std::ostringstream address;
      address << participant->guid().guidPrefix;
      ClaimSharedMemory(shared_memory, address.str());
    }
    publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  }

  ~Impl() {
    if (participant == nullptr) return;
    participant->set_listener(nullptr);
    participant->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  /// The topic of T. Its type is registered under a name that contains the schema hash: endpoints of two schemas never
  /// match.
  template <class T>
  fast::Topic* TopicFor() {
    const TopicRole& role = RoleOf<T>();
    const std::lock_guard lock(mutex);
    fast::Topic*& topic = topics[static_cast<std::size_t>(role.id)];
    if (topic != nullptr) return topic;
    fast::TypeSupport type(MakeType<T>());
    type->setName(TypeName(role).c_str());
    return topic = MakeTopic(role, type);
  }

  template <class T>
  fast::TopicDataType* MakeType() const {
    if constexpr (Loanable<T>) {
      return new dds::LoanType(kTopicOf<T>, loan_B<T>());
    } else {
      return new dds::CheckedType<T>();
    }
  }

  /// Size of a large topic's loans.
  template <Loanable T>
  [[nodiscard]] std::size_t loan_B() const {
    return LoanBytes(static_cast<const T*>(nullptr), tissue_vertices);
  }

  fast::Topic* MakeTopic(const TopicRole& role, const fast::TypeSupport& type) {
    fast::Topic* topic = nullptr;
    if (type.register_type(participant) == dds::ReturnCode::RETCODE_OK) {
      topic = participant->create_topic(role.name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    }
    if (topic == nullptr) throw InputError(std::string(role.name) + ": cannot make the topic");
    return topic;
  }

  [[nodiscard]] std::string TypeName(const TopicRole& role) const {
    return std::string(role.name) + "#" + Hex(schema_hash);
  }

  /// Directory in which the samples of a topic are shared; empty: they are sent by UDP.
  [[nodiscard]] std::string SharedMemoryFor(const TopicRole& role) const {
    return role.quality.path == Path::kSharedMemory && !security.encrypt ? shared_memory.string() : std::string();
  }

  /// Error message for an endpoint that the library did not make.
  [[nodiscard]] std::string CannotMake(const TopicRole& role, const char* what) const {
    return std::string(role.name) + ": cannot make a " + what +
           (security.on() ? ": access control refuses it to \"" + security.identity + "\" (keys of " +
                                security.keys.string() + "; fulcrum keys show lists the rights)"
                          : "");
  }

  const std::uint64_t schema_hash;
  const std::size_t tissue_vertices;
  std::filesystem::path shared_memory;
  const Security security;
  const std::shared_ptr<dds::Gathering> gathering;
  dds::SessionCheck session;
  dds::PeerWatch watch;
  dds::Audience audience;
  dds::Sources sources;         ///< Of the raw inputs.
  std::atomic<int> writers{0};  ///< Made so far.
  fast::DomainParticipant* participant = nullptr;
  fast::Publisher* publisher = nullptr;
  fast::Subscriber* subscriber = nullptr;
  std::mutex mutex;  ///< Guards topics.
  std::array<fast::Topic*, kTopicCount> topics{};
};

DdsParticipant::DdsParticipant(const DdsSettings& settings)
    : impl_(std::make_unique<Impl>(settings, settings.schema_hash)) {}
DdsParticipant::~DdsParticipant() = default;

std::string DdsParticipant::schema_mismatch() const { return impl_->watch.mismatch(); }
Refusals DdsParticipant::refusals() const { return impl_->watch.refusals(); }

template <class T>
std::unique_ptr<Input<T>> DdsParticipant::MakeInput(std::function<void()> notify) {
  const TopicRole& role = RoleOf<T>();
  fast::DataReaderQos qos;
  Apply(role.quality, role.quality.reader_depth, impl_->SharedMemoryFor(role), &qos);
  qos.reliable_reader_qos().times.initialAcknackDelay = kFirstAcknack;
  const WorkingIn here(impl_->shared_memory);
  std::unique_ptr<dds::DdsInput<T>> port;
  if constexpr (Loanable<T>) {
    port = std::make_unique<dds::DdsInput<T>>(impl_->loan_B<T>(), impl_->subscriber, impl_->TopicFor<T>(), qos,
                                              std::move(notify), &impl_->session);
  } else {
    port = std::make_unique<dds::DdsInput<T>>(impl_->subscriber, impl_->TopicFor<T>(), qos, std::move(notify),
                                              &impl_->session);
  }
  if (!port->ok()) throw InputError(impl_->CannotMake(role, "reader"));
  if (role.quality.path == Path::kSharedMemory) ReserveSharedMemory(impl_->shared_memory);
  return port;
}

template <class T>
std::unique_ptr<typename OutputOf<T>::type> DdsParticipant::MakeOutput() {
  const TopicRole& role = RoleOf<T>();
  fast::Topic* topic = impl_->TopicFor<T>();
  fast::DataWriterQos qos;
  Apply(role.quality, role.quality.writer_depth, impl_->SharedMemoryFor(role), &qos);
  // Not for TickManifest: a standby takes over 35 ms after the newest one, so a lost one must be repaired sooner.
  if (role.id == TopicId::kCauteryContact) {
    qos.reliable_writer_qos().disable_heartbeat_piggyback = true;
    qos.reliable_writer_qos().times.heartbeatPeriod = kStreamHeartbeat;
  }
  const std::unique_ptr<fast::TopicDataType> type(impl_->MakeType<T>());
  const bool fragmented = impl_->SharedMemoryFor(role).empty() && type->m_typeSize > kDatagram_B;
  // A reliable writer sends several samples in one datagram when it repeats them.
  const bool packed = impl_->security.encrypt && (fragmented || role.quality.delivery == Delivery::kReliable);
  qos.publish_mode().kind = fragmented || packed ? fast::ASYNCHRONOUS_PUBLISH_MODE : fast::SYNCHRONOUS_PUBLISH_MODE;
  if (packed) qos.publish_mode().flow_controller_name = dds::kPacking;
  const WorkingIn here(impl_->shared_memory);
  std::unique_ptr<dds::DdsOutput<T>> port;
  if constexpr (Loanable<T>) {
    port = std::make_unique<dds::DdsOutput<T>>(impl_->loan_B<T>(), impl_->publisher, topic, qos, &impl_->audience,
                                               impl_->session.session);
  } else {
    port = std::make_unique<dds::DdsOutput<T>>(impl_->publisher, topic, qos, &impl_->audience, impl_->session.session);
  }
  if (!port->ok()) throw InputError(impl_->CannotMake(role, "writer"));
  ++impl_->writers;
  if (role.quality.path == Path::kSharedMemory) ReserveSharedMemory(impl_->shared_memory);
  return port;
}

std::unique_ptr<RawInput> DdsParticipant::MakeRawInput(TopicId id, RawSink sink) {
  const TopicRole& role = RoleOf(id);
  const std::uint32_t payload_B = WithMessageOf(id, [this]<class T>(std::type_identity<T>) {
    return std::unique_ptr<fast::TopicDataType>(impl_->MakeType<T>())->m_typeSize;
  });
  fast::Topic* topic =
      impl_->MakeTopic(role, fast::TypeSupport(new dds::RawType(impl_->TypeName(role), payload_B, role)));
  fast::DataReaderQos qos;
  Apply(role.quality, role.quality.reader_depth, impl_->SharedMemoryFor(role), &qos);
  qos.reliable_reader_qos().times.initialAcknackDelay = kFirstAcknack;
  const WorkingIn here(impl_->shared_memory);
  auto input = std::make_unique<dds::RawReader>(impl_->subscriber, topic, qos, id, payload_B, std::move(sink),
                                                impl_->gathering, &impl_->sources, &impl_->session);
  if (!input->ok()) throw InputError(impl_->CannotMake(role, "reader"));
  return input;
}

std::uint64_t DdsParticipant::foreign_samples() const { return impl_->session.foreign.load(std::memory_order_relaxed); }

std::uint64_t DdsParticipant::inherited_locks() { return dds::SharedLocks().inherited; }

bool DdsParticipant::HasParticipant(const std::string& name) const { return !impl_->watch.Named(name).empty(); }

namespace {

std::string AddressOf(const rtps::GuidPrefix_t& prefix) {
  std::string text;
  for (const rtps::octet byte : prefix.value) {
    constexpr const char* kDigits = "0123456789abcdef";
    text.push_back(kDigits[byte >> 4]);
    text.push_back(kDigits[byte & 0xf]);
  }
  return text;
}

}  // namespace

std::string DdsParticipant::address() const { return AddressOf(impl_->participant->guid().guidPrefix); }

int DdsParticipant::writer_count() const { return impl_->writers; }

bool DdsParticipant::IsReadBy(const std::string& name) const {
  return std::ranges::any_of(impl_->watch.Named(name),
                             [&](const rtps::GuidPrefix_t& prefix) { return impl_->audience.Reaches(prefix); });
}

std::vector<ReadPeer> DdsParticipant::PeersRead() const {
  std::vector<ReadPeer> peers;
  for (const auto& [prefix, match] : impl_->sources.matches()) {
    peers.push_back({AddressOf(prefix), match.writers, match.since_ns});
  }
  return peers;
}

Peer DdsParticipant::PeerOf(const WriterGuid& writer) const {
  rtps::GuidPrefix_t prefix;
  std::copy_n(writer.begin(), rtps::GuidPrefix_t::size, prefix.value);
  return impl_->watch.PeerOf(prefix);
}

#define FULCRUM_INSTANTIATE_PORTS(T)                                                   \
  template std::unique_ptr<Input<T>> DdsParticipant::MakeInput(std::function<void()>); \
  template std::unique_ptr<typename OutputOf<T>::type> DdsParticipant::MakeOutput<T>();

FULCRUM_MESSAGES(FULCRUM_INSTANTIATE_PORTS)

#undef FULCRUM_INSTANTIATE_PORTS

}  // namespace fulcrum::bus
