// The DDS backend of RawInput. Internal to services/transport/bus/dds.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "services/transport/bus/dds/chained_transport.h"
#include "services/transport/bus/dds/session_check.h"
#include "services/transport/bus/dds/sources.h"
#include "services/transport/bus/dds/type_support.h"
#include "services/transport/bus/raw_input.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::bus::dds {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/// Stands for any type by name and size: a sample is its payload, of a large topic as many bytes of it as the message
/// needs. For readers only.
class RawType final : public fast::TopicDataType {
 public:
  /// @param payload_B largest payload, encapsulation included.
  RawType(const std::string& name, std::uint32_t payload_B, const TopicRole& role)
      : topic_(role.id), plain_(role.quality.path == Path::kSharedMemory) {
    setName(name.c_str());
    m_typeSize = payload_B;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void*, rtps::SerializedPayload_t*) override { return false; }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    std::span whole(reinterpret_cast<const std::byte*>(payload->data), payload->length);
    if (plain_ && whole.size() > kEncapsulation_B) {
      const std::size_t needed_B = kEncapsulation_B + NeededBytes(topic_, whole.subspan(kEncapsulation_B));
      whole = whole.first(std::min(whole.size(), needed_B));
    }
    static_cast<std::vector<std::byte>*>(data)->assign(whole.begin(), whole.end());
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 0u; };
  }
  void* createData() override { return new std::vector<std::byte>(); }
  void deleteData(void* data) override { delete static_cast<std::vector<std::byte>*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
  [[nodiscard]] bool is_bounded() const override { return true; }
  [[nodiscard]] bool is_plain() const override { return plain_; }

 private:
  const TopicId topic_;
  const bool plain_;
};

/// Passes each sample on, and sets `caught_up` for its transport when no small sample is left unread.
class RawReader final : public RawInput, private fast::DataReaderListener {
 public:
  RawReader(fast::Subscriber* subscriber, fast::Topic* topic, const fast::DataReaderQos& qos, TopicId id,
            std::uint32_t payload_B, RawSink sink, std::shared_ptr<Gathering> gathering, Sources* sources,
            SessionCheck* check);
  ~RawReader() override;
  RawReader(const RawReader&) = delete;
  RawReader& operator=(const RawReader&) = delete;

  [[nodiscard]] bool ok() const { return reader_ != nullptr; }
  [[nodiscard]] bool matched() const noexcept override { return writers_.load(std::memory_order_relaxed) > 0; }

 private:
  void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
    // Relaxed: an independent value that orders nothing.
    writers_.store(status.current_count, std::memory_order_relaxed);
    sources_->Count(rtps::iHandle2GUID(status.last_publication_handle).guidPrefix, status.current_count_change);
  }
  void on_data_available(fast::DataReader* reader) override;
  void Take(fast::DataReader* reader);
  [[nodiscard]] RawSample Describe(const fast::SampleInfo& info) const;

  const TopicRole& role_;
  const RawSink sink_;
  const std::shared_ptr<Gathering> gathering_;  ///< Null: samples do not gather.
  Sources* const sources_;
  SessionCheck* const check_;
  fast::Subscriber* subscriber_;
  fast::DataReader* reader_;
  std::atomic<int> writers_{0};
  std::vector<std::byte> payload_;
};

}  // namespace fulcrum::bus::dds
