// Which generated type carries a message. Internal to services/bus/dds.
#pragma once

#include "cauteryPubSubTypes.h"
#include "contactPubSubTypes.h"
#include "handlePubSubTypes.h"
#include "healthPubSubTypes.h"
#include "services/core/messages.h"
#include "sessionPubSubTypes.h"
#include "temperaturePubSubTypes.h"
#include "thermal_eventPubSubTypes.h"
#include "tissuePubSubTypes.h"
#include "toolPubSubTypes.h"
#include "topologyPubSubTypes.h"

namespace fulcrum::bus::dds {

template <class T>
struct TypeSupportOf;
template <>
struct TypeSupportOf<HandleState> {
  using type = idl::HandleStatePubSubType;
};
template <>
struct TypeSupportOf<ToolState> {
  using type = idl::ToolStatePubSubType;
};
template <>
struct TypeSupportOf<TissueFrame> {
  using type = idl::TissueFramePubSubType;
};
template <>
struct TypeSupportOf<ContactModel> {
  using type = idl::ContactModelPubSubType;
};
template <>
struct TypeSupportOf<CauteryContact> {
  using type = idl::CauteryContactPubSubType;
};
template <>
struct TypeSupportOf<TopologyState> {
  using type = idl::TopologyStatePubSubType;
};
template <>
struct TypeSupportOf<TemperaturePatch> {
  using type = idl::TemperaturePatchPubSubType;
};
template <>
struct TypeSupportOf<ThermalEvent> {
  using type = idl::ThermalEventPubSubType;
};
template <>
struct TypeSupportOf<SceneManifest> {
  using type = idl::SceneManifestPubSubType;
};
template <>
struct TypeSupportOf<Command> {
  using type = idl::CommandPubSubType;
};
template <>
struct TypeSupportOf<CommandReply> {
  using type = idl::CommandReplyPubSubType;
};
template <>
struct TypeSupportOf<TickManifest> {
  using type = idl::TickManifestPubSubType;
};
template <>
struct TypeSupportOf<Health> {
  using type = idl::HealthPubSubType;
};

template <class T>
using WireOf = typename TypeSupportOf<T>::type::type;

/// Travels by loan.
template <class T>
concept Loanable = requires {
  typename T::View;
};

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
