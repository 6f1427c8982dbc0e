#include "tests/support/rogue.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/security.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/topics.h"
#include "tests/support/session_bus.h"

namespace fulcrum::testing {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr int kPerMillisecond = 20;
constexpr auto kMatchTime = std::chrono::milliseconds(300);
constexpr std::uint32_t kLongestBytes = 60'000;  // One datagram.
constexpr std::array kBroken{std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f,
                             -1e30f};

using Bytes = std::vector<std::uint8_t>;

/// Raw bytes under the type name of a topic.
class RawType final : public fast::TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    m_typeSize = kLongestBytes;
    m_isGetKeyDefined = false;
    setName(name.c_str());
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<Bytes*>(data);
    std::copy(bytes.begin(), bytes.end(), payload->data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

std::string TypeName(const bus::TopicRole& role) {
  std::array<char, 17> hash{};
  std::snprintf(hash.data(), hash.size(), "%016llx", static_cast<unsigned long long>(bus::SchemaHash()));
  return std::string(role.name) + "#" + hash.data();
}

Bytes NoMessage(std::mt19937* random) {
  constexpr std::array<std::size_t, 9> kLengths{4, 5, 8, 17, 28, 60, 200, 1400, kLongestBytes};
  Bytes bytes(kLengths[(*random)() % kLengths.size()]);
  // All ones give invalid numbers and lengths beyond any message; few zeros give lengths that almost fit.
  const unsigned kind = (*random)() % 4;
  for (std::uint8_t& byte : bytes) {
    const auto any = static_cast<std::uint8_t>((*random)());
    byte = kind == 0 ? 0xff : kind == 1 ? (any % 16 == 0 ? any : 0) : any;
  }
  const std::array<std::uint8_t, 4> header{0, static_cast<std::uint8_t>(kind == 3 ? (*random)() : 1), 0, 0};
  std::copy(header.begin(), header.end(), bytes.begin());
  return bytes;
}

fast::DomainParticipant* Join(int domain, fast::DomainParticipantQos qos) {
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  return fast::DomainParticipantFactory::get_instance()->create_participant(static_cast<std::uint32_t>(domain), qos);
}

void Leave(fast::DomainParticipant* participant) {
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

/// Makes a writer of raw bytes whose QoS matches the readers of any topic.
fast::DataWriter* MakeWriter(fast::DomainParticipant* participant, fast::Publisher* publisher,
                             const bus::TopicRole& role) {
  fast::TypeSupport type(new RawType(TypeName(role)));
  type.register_type(participant);
  fast::DataWriterQos writer;
  writer.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  writer.reliability().max_blocking_time = {0, 5'000'000};
  writer.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  writer.history().depth = 1;
  writer.data_sharing().off();
  writer.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  auto* topic = participant->create_topic(role.name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  return publisher->create_datawriter(topic, writer);
}

}  // namespace

struct Rogue::Impl {
  explicit Impl(const bus::DdsSettings& settings)
      : bus(settings),
        participant(settings),
        epoch(static_cast<std::uint64_t>(runtime::MonotonicNs())),
        stamper(static_cast<std::int64_t>(epoch)) {}

  Stamp Next() { return stamper.Next(runtime::MonotonicNs()); }

  ToolState Tool(std::mt19937* random) {
    ToolState state;
    state.stamp = Next();
    for (ToolSample& tool : state.tools) tool.kind = ToolKind::kGrasper;
    ToolSample& tool = state.tools[(*random)() % kMaxTools];
    const float broken = kBroken[(*random)() % kBroken.size()];
    switch ((*random)() % 4) {
      case 0:
        tool.p_WT[static_cast<int>((*random)() % 3)] = broken;
        break;
      case 1:
        tool.q_WT.coeffs()[static_cast<int>((*random)() % 4)] = broken;
        break;
      case 2:
        tool.q_WT.coeffs().setZero();
        break;
      default:
        tool.f_W[static_cast<int>((*random)() % 3)] = broken;
    }
    return state;
  }
  ContactModel Model(std::mt19937* random) {
    ContactModel model;
    model.stamp = Next();
    model.tool_stamp_ns = model.stamp.stamp_ns;
    for (DeviceContacts& device : model.devices) {
      device.count = 1 + (*random)() % 6;
      device.contacts[0].kind = ContactKind::kGrasp;
      device.contacts[0].k1 = device.contacts[0].k_body = 1000;
      device.contacts[0].f_ref.x() = kBroken[(*random)() % kBroken.size()];
    }
    return model;
  }
  template <class T>
  std::uint64_t Pour(double seconds, const std::function<T()>& make) {
    const auto output = participant.MakeOutput<T>();
    std::this_thread::sleep_for(kMatchTime);
    std::uint64_t sent = 0;
    const auto start = std::chrono::steady_clock::now();
    for (auto next = start; next - start < std::chrono::duration<double>(seconds);) {
      for (int i = 0; i < kPerMillisecond; ++i) sent += output->Write(make()) ? 1 : 0;
      next += std::chrono::milliseconds(1);
      std::this_thread::sleep_until(next);
    }
    return sent;
  }

  const bus::DdsSettings bus;
  bus::DdsParticipant participant;
  const std::uint64_t epoch;
  bus::Stamper stamper;
};

Rogue::Rogue(int domain) : Rogue(WriterOf(domain, "rogue")) {}
Rogue::Rogue(const bus::DdsSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
Rogue::~Rogue() = default;

std::uint64_t Rogue::epoch() const { return impl_->epoch; }

std::uint64_t Rogue::Pour(Flood what, double seconds, std::uint32_t seed) {
  std::mt19937 random(seed);
  switch (what) {
    case Flood::kToolState:
      return impl_->Pour<ToolState>(seconds, [&] { return impl_->Tool(&random); });
    case Flood::kContactModel:
      return impl_->Pour<ContactModel>(seconds, [&] { return impl_->Model(&random); });
  }
  return 0;
}

std::uint64_t Rogue::PourBytes(int per_topic, std::uint32_t seed) {
  std::mt19937 random(seed);
  fast::DomainParticipantQos qos;
  const bus::Security& security = impl_->bus.security;
  const auto gate = security.on() ? bus::dds::ApplySecurity(security, &qos) : nullptr;
  fast::DomainParticipant* participant = Join(impl_->bus.domain, qos);
  if (gate) gate->Open();
  if (participant == nullptr) return 0;
  fast::Publisher* publisher = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  std::vector<fast::DataWriter*> writers;
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    writers.push_back(MakeWriter(participant, publisher, role));
  }
  std::this_thread::sleep_for(kMatchTime);
  std::uint64_t sent = 0;
  for (int i = 0; i < per_topic; ++i) {
    for (fast::DataWriter* writer : writers) {
      Bytes bytes = NoMessage(&random);
      sent += writer != nullptr && writer->write(&bytes) ? 1 : 0;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  Leave(participant);
  return sent;
}

void WriteForgedTools(int domain, const std::string& name, const bus::Security& security,
                      const std::string& authorities, const std::string& permissions, Bytes bytes,
                      std::chrono::seconds time) {
  fast::DomainParticipantQos qos;
  qos.name(name);
  const auto gate = bus::dds::ApplySecurity(security, &qos);
  for (rtps::Property& property : qos.properties().properties()) {
    if (property.name().ends_with(".permissions_ca")) property.value("file://" + authorities);
    if (property.name().ends_with(".permissions")) property.value("file://" + permissions);
  }
  fast::DomainParticipant* participant = Join(domain, qos);
  gate->Open();
  if (participant == nullptr) throw std::runtime_error("the library made no participant");
  fast::DataWriter* writer = MakeWriter(participant, participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT),
                                        bus::RoleOf(TopicId::kToolState));
  if (writer == nullptr) throw std::runtime_error("the library made no writer");
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < time) {
    writer->write(&bytes);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  Leave(participant);
}

}  // namespace fulcrum::testing
