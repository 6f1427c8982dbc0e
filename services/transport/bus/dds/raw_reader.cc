#include "services/transport/bus/dds/raw_reader.h"

#include <time.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "services/transport/bus/convert/convert.h"

namespace fulcrum::bus::dds {
namespace {

using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

/// Encapsulation in front of a loan's content on the wire: CDR, little endian.
constexpr std::array<std::byte, kEncapsulation_B> kEncapsulation{std::byte{0}, std::byte{1}, std::byte{0},
                                                                 std::byte{0}};

/// A sample of at most this age was waited for; an older one was in the socket, which may contain more [ns].
constexpr std::int64_t kFresh_ns = 500'000;

std::int64_t Now(clockid_t clock) {
  timespec now{};
  ::clock_gettime(clock, &now);
  return std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec;
}

/// Two clocks that were read at most so far apart [ns] can be converted into each other.
constexpr std::int64_t kClocksApart_ns = 20'000;

/// Age of a sample [ns]; empty: the wall clock was set after it was written.
std::optional<std::int64_t> Age(std::int64_t source_ns) {
  constexpr std::int64_t kOldest_ns = 1'000'000'000;
  const std::int64_t age_ns = Now(CLOCK_REALTIME) - source_ns;
  return age_ns >= 0 && age_ns <= kOldest_ns ? std::optional(age_ns) : std::nullopt;
}

}  // namespace

RawReader::RawReader(fast::Subscriber* subscriber, fast::Topic* topic, const fast::DataReaderQos& qos, TopicId id,
                     std::uint32_t payload_B, RawSink sink, std::shared_ptr<Gathering> gathering, Sources* sources,
                     SessionCheck* check)
    : role_(RoleOf(id)),
      sink_(std::move(sink)),
      gathering_(std::move(gathering)),
      sources_(sources),
      check_(check),
      subscriber_(subscriber) {
  payload_.reserve(payload_B);
  fast::StatusMask mask = fast::StatusMask::subscription_matched();
  mask << fast::StatusMask::data_available();
  reader_ = subscriber->create_datareader(topic, qos, this, mask);
}

RawReader::~RawReader() {
  if (reader_ == nullptr) return;
  reader_->set_listener(nullptr);
  subscriber_->delete_datareader(reader_);
}

RawSample RawReader::Describe(const fast::SampleInfo& info) const {
  RawSample sample;
  sample.topic = role_.id;
  const rtps::GUID_t& guid = info.sample_identity.writer_guid();
  std::memcpy(sample.writer.data(), guid.guidPrefix.value, rtps::GuidPrefix_t::size);
  std::memcpy(sample.writer.data() + rtps::GuidPrefix_t::size, guid.entityId.value, rtps::EntityId_t::size);
  sample.sequence = info.sample_identity.sequence_number().to64long();
  sample.source_ns = info.source_timestamp.to_ns();
  // The thread may be preempted between the two clocks: retried then.
  for (int attempt = 0; attempt < 3; ++attempt) {
    const std::int64_t before_ns = Now(CLOCK_MONOTONIC);
    sample.written_ns = before_ns - Age(sample.source_ns).value_or(0);
    if (Now(CLOCK_MONOTONIC) - before_ns < kClocksApart_ns) break;
  }
  return sample;
}

void RawReader::on_data_available(fast::DataReader* reader) {
  try {
    Take(reader);
  } catch (...) {
    // A sample that cannot be taken is missing in its writer's sequence, where it is counted.
  }
}

void RawReader::Take(fast::DataReader* reader) {
  const bool large = role_.quality.path == Path::kSharedMemory;
  fast::SampleInfo info;
  std::optional<std::int64_t> age_ns;
  while (reader->take_next_sample(&payload_, &info) == ReturnCode::RETCODE_OK) {
    if (!info.valid_data || payload_.size() < kEncapsulation_B) continue;
    RawSample sample = Describe(info);
    // The writer of a loan leaves its encapsulation unset.
    sample.head = large ? std::span<const std::byte>(kEncapsulation) : std::span(payload_).first(kEncapsulation_B);
    sample.body = std::span(payload_).subspan(kEncapsulation_B);
    if (check_->IsForeign(SessionOf(sample.body))) continue;
    sink_(sample);
    if (!large) age_ns = Age(sample.source_ns);
  }
  if (age_ns && gathering_) gathering_->caught_up = *age_ns <= kFresh_ns;
}

}  // namespace fulcrum::bus::dds
