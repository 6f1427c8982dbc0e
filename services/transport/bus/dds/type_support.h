// Type support of the generated types. Internal to services/transport/bus/dds.
#pragma once

#include "services/transport/bus/convert/generated_types.h"

namespace fulcrum::bus::dds {

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
      if constexpr (Loanable<T>) {
        wire.header().stamp().stamp_ns(-1);
      } else {
        wire.stamp().stamp_ns(-1);
      }
    }
    return true;
  }
};

}  // namespace fulcrum::bus::dds
