// Type support of the generated types and of loans. Internal to services/transport/bus/dds.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <span>

#include "services/transport/bus/convert/convert.h"
#include "services/transport/bus/convert/generated_types.h"

namespace fulcrum::bus::dds {

/// Encapsulation in front of a message on the wire [B].
inline constexpr std::size_t kEncapsulation_B = 4;

/// The generated type, except that bytes that are no valid T become a T that no gate accepts, so that they are refused
/// and counted like any bad message. The library alone would silently drop payloads that are cut short, and would leave
/// undecodable ones at the head of the queue, where they block all later samples.
template <class T>
class CheckedType final : public TypeSupportOf<T>::type {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    bool good = false;
    try {
      good = TypeSupportOf<T>::type::deserialize(payload, data);
    } catch (...) {
      good = false;
    }
    if (!good) {
      WireOf<T>& wire = *static_cast<WireOf<T>*>(data);
      wire = WireOf<T>();
      wire.stamp().stamp_ns(-1);
    }
    return true;
  }
};

/// A large topic: its samples are bytes, which the library takes for a plain type of the size that the pools are to
/// have. A writer fills loans of it; a reader copies the writer's loan, or the bytes that came by UDP.
class LoanType final : public eprosima::fastdds::dds::TopicDataType {
 public:
  /// @param loan_B largest message.
  LoanType(TopicId topic, std::size_t loan_B) : topic_(topic), loan_B_(loan_B) {
    m_typeSize = static_cast<std::uint32_t>(kEncapsulation_B + loan_B);
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }

  bool serialize(void*, eprosima::fastrtps::rtps::SerializedPayload_t*) override { return false; }
  /// Copies as many bytes as the message needs. What is cut short becomes a message that no gate accepts. In shared
  /// memory the writer may be writing the next message meanwhile: the library drops such a copy.
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    const std::span loan(static_cast<std::byte*>(data), loan_B_);
    const std::size_t head_B = std::min<std::size_t>(payload->length, kEncapsulation_B);
    const std::span received(reinterpret_cast<const std::byte*>(payload->data) + head_B, payload->length - head_B);
    const std::size_t needed_B = NeededBytes(topic_, received);
    if (needed_B > std::min(received.size(), loan_B_)) {
      SpoilLoan(loan);
    } else {
      std::memcpy(data, received.data(), needed_B);
    }
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [this] { return m_typeSize; };
  }
  void* createData() override { return new std::byte[loan_B_]; }
  void deleteData(void* data) override { delete[] static_cast<std::byte*>(data); }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
  [[nodiscard]] bool is_bounded() const override { return true; }
  [[nodiscard]] bool is_plain() const override { return true; }

 private:
  const TopicId topic_;
  const std::size_t loan_B_;
};

}  // namespace fulcrum::bus::dds
