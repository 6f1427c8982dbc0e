// Which generated type carries a message. Seen by services/bus/convert and services/bus/dds only.
#pragma once

#include "cauteryPubSubTypes.h"
#include "contactPubSubTypes.h"
#include "generatorPubSubTypes.h"
#include "handlePubSubTypes.h"
#include "healthPubSubTypes.h"
#include "services/core/messages.h"
#include "sessionPubSubTypes.h"
#include "temperaturePubSubTypes.h"
#include "thermal_eventPubSubTypes.h"
#include "tissuePubSubTypes.h"
#include "toolPubSubTypes.h"
#include "topologyPubSubTypes.h"

namespace fulcrum::bus {

template <class T>
struct TypeSupportOf;
template <>
struct TypeSupportOf<HandleState> {
  using type = idl::HandleStatePubSubType;
};
template <>
struct TypeSupportOf<GeneratorSetting> {
  using type = idl::GeneratorSettingPubSubType;
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
struct TypeSupportOf<TearState> {
  using type = idl::TearStatePubSubType;
};
template <>
struct TypeSupportOf<OpenCells> {
  using type = idl::OpenCellsPubSubType;
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

/// Travels by loan, as its memory: of a plain type that is its CDR, too.
template <class T>
concept Loanable = requires {
  typename T::View;
};

}  // namespace fulcrum::bus
