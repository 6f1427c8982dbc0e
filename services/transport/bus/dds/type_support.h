// How the library is told of the generated types. Internal to services/transport/bus/dds.
#pragma once

#include "services/transport/bus/convert/generated_types.h"

namespace fulcrum::bus::dds {

/// The generated type, but bytes that are no T become a T that no gate lets pass, so that they are refused and counted
/// like any bad message. The library would drop silently what is cut short, and leave what cannot be decoded at all at
/// the head of the queue, where it holds up everything behind it.
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
