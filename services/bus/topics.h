// The one place with all topic names and the roles that decide their quality of service. Depths are named by meaning:
// what a reader that looks at its slowest rate must still find, and what a late joiner must be given.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <type_traits>

#include "services/core/messages.h"

namespace fulcrum::bus {

enum class Path : std::uint8_t {
  kLoopback,      ///< UDP on 127.0.0.1, serialised.
  kSharedMemory,  ///< Data-sharing with loans: plain types, at most 100 Hz.
};

struct TopicRole {
  TopicId id;
  const char* name;
  Path path;
  bool reliable;
  /// A late joiner is given the newest `writer_depth` samples of each live writer.
  bool late_joiners_served;
  /// No sample may be replaced by a newer one; a writer without room fails instead.
  bool keep_all;
  /// A gap in the sequence is a loss. False where the ring is overwritten on purpose because only the newest counts.
  bool gap_is_loss;
  int writer_depth;
  int reader_depth;
  /// One process at a time sends it: once a later epoch has been heard, what an earlier one still sends is refused.
  [[nodiscard]] constexpr bool one_owner() const {
    return id != TopicId::kCommand && id != TopicId::kCommandReply && id != TopicId::kTickManifest &&
           id != TopicId::kHealth;
  }
};

// Reader depths cover the slowest reader of a topic between two looks: a software frame on a loaded machine takes up to
// a second, 1000 ToolStates of 168 bytes, so a gap means a real loss and not a slow reader. Topics with several writers
// have no keys (keys rule out data-sharing and cost a lookup): their readers are deep enough for the burst of all
// writers at once.
inline constexpr int kLatestOnly = 1;
inline constexpr int kStreamAtSlowestReader = 1024;
inline constexpr int kFrameRing = 4;
/// What a reader that was started again has missed: more than half a second of a stream of 100 Hz.
inline constexpr int kOutage = 64;
/// Each patch belongs to one slot of the atlas, so a renderer at 15 Hz needs every one of the 60 Hz stream.
inline constexpr int kPatchRing = 16;
inline constexpr int kEventBurst = 512;
inline constexpr int kAllWriters = 64;
inline constexpr int kCommandBacklog = 256;

inline constexpr std::array<TopicRole, kTopicCount> kTopicRoles{{
    {TopicId::kHandleState, "fulcrum/HandleState", Path::kLoopback, false, false, false, true, kLatestOnly,
     kStreamAtSlowestReader},
    {TopicId::kToolState, "fulcrum/ToolState", Path::kLoopback, false, false, false, true, kLatestOnly,
     kStreamAtSlowestReader},
    {TopicId::kTissueFrame, "fulcrum/TissueFrame", Path::kSharedMemory, false, true, false, false, kFrameRing,
     kFrameRing},
    {TopicId::kContactModel, "fulcrum/ContactModel", Path::kLoopback, false, false, false, true, kLatestOnly,
     kStreamAtSlowestReader},
    {TopicId::kCauteryContact, "fulcrum/CauteryContact", Path::kLoopback, true, true, false, true, kOutage,
     kStreamAtSlowestReader},
    {TopicId::kTopologyState, "fulcrum/TopologyState", Path::kLoopback, true, true, false, false, kLatestOnly,
     kFrameRing},
    {TopicId::kTemperaturePatch, "fulcrum/TemperaturePatch", Path::kSharedMemory, false, true, false, true, kPatchRing,
     kPatchRing},
    {TopicId::kThermalEvent, "fulcrum/ThermalEvent", Path::kLoopback, true, false, false, true, kEventBurst,
     kEventBurst},
    {TopicId::kSceneManifest, "fulcrum/SceneManifest", Path::kLoopback, true, true, false, false, kLatestOnly,
     kFrameRing},
    {TopicId::kCommand, "fulcrum/Command", Path::kLoopback, true, false, true, true, kCommandBacklog, kCommandBacklog},
    {TopicId::kCommandReply, "fulcrum/CommandReply", Path::kLoopback, true, false, true, true, kCommandBacklog,
     kCommandBacklog},
    {TopicId::kTickManifest, "fulcrum/TickManifest", Path::kLoopback, true, false, false, true, kEventBurst,
     kEventBurst},
    {TopicId::kHealth, "fulcrum/Health", Path::kLoopback, true, true, false, true, kLatestOnly, kAllWriters},
    {TopicId::kTearState, "fulcrum/TearState", Path::kLoopback, true, true, false, false, kLatestOnly, kFrameRing},
    {TopicId::kOpenCells, "fulcrum/OpenCells", Path::kLoopback, true, true, false, false, kLatestOnly, kFrameRing},
    {TopicId::kGeneratorSetting, "fulcrum/GeneratorSetting", Path::kLoopback, true, true, false, false, kLatestOnly,
     kOutage},
}};

[[nodiscard]] constexpr const TopicRole& RoleOf(TopicId id) { return kTopicRoles[static_cast<std::size_t>(id)]; }

/// Message type to topic.
template <class T>
inline constexpr TopicId kTopicOf = TopicId::kHealth;
template <>
inline constexpr TopicId kTopicOf<HandleState> = TopicId::kHandleState;
template <>
inline constexpr TopicId kTopicOf<ToolState> = TopicId::kToolState;
template <>
inline constexpr TopicId kTopicOf<TissueFrame> = TopicId::kTissueFrame;
template <>
inline constexpr TopicId kTopicOf<ContactModel> = TopicId::kContactModel;
template <>
inline constexpr TopicId kTopicOf<CauteryContact> = TopicId::kCauteryContact;
template <>
inline constexpr TopicId kTopicOf<TopologyState> = TopicId::kTopologyState;
template <>
inline constexpr TopicId kTopicOf<TemperaturePatch> = TopicId::kTemperaturePatch;
template <>
inline constexpr TopicId kTopicOf<ThermalEvent> = TopicId::kThermalEvent;
template <>
inline constexpr TopicId kTopicOf<SceneManifest> = TopicId::kSceneManifest;
template <>
inline constexpr TopicId kTopicOf<Command> = TopicId::kCommand;
template <>
inline constexpr TopicId kTopicOf<CommandReply> = TopicId::kCommandReply;
template <>
inline constexpr TopicId kTopicOf<TickManifest> = TopicId::kTickManifest;
template <>
inline constexpr TopicId kTopicOf<TearState> = TopicId::kTearState;
template <>
inline constexpr TopicId kTopicOf<OpenCells> = TopicId::kOpenCells;
template <>
inline constexpr TopicId kTopicOf<GeneratorSetting> = TopicId::kGeneratorSetting;

template <class T>
[[nodiscard]] constexpr const TopicRole& RoleOf() {
  return RoleOf(kTopicOf<T>);
}

/// Calls `f(std::type_identity<T>())` with the message type of a topic that is only known at run time.
template <class F>
decltype(auto) WithMessageOf(TopicId id, F&& f) {
  switch (id) {
    case TopicId::kHandleState:
      return f(std::type_identity<HandleState>());
    case TopicId::kToolState:
      return f(std::type_identity<ToolState>());
    case TopicId::kTissueFrame:
      return f(std::type_identity<TissueFrame>());
    case TopicId::kContactModel:
      return f(std::type_identity<ContactModel>());
    case TopicId::kCauteryContact:
      return f(std::type_identity<CauteryContact>());
    case TopicId::kTopologyState:
      return f(std::type_identity<TopologyState>());
    case TopicId::kTemperaturePatch:
      return f(std::type_identity<TemperaturePatch>());
    case TopicId::kThermalEvent:
      return f(std::type_identity<ThermalEvent>());
    case TopicId::kSceneManifest:
      return f(std::type_identity<SceneManifest>());
    case TopicId::kCommand:
      return f(std::type_identity<Command>());
    case TopicId::kCommandReply:
      return f(std::type_identity<CommandReply>());
    case TopicId::kTickManifest:
      return f(std::type_identity<TickManifest>());
    case TopicId::kTearState:
      return f(std::type_identity<TearState>());
    case TopicId::kOpenCells:
      return f(std::type_identity<OpenCells>());
    case TopicId::kGeneratorSetting:
      return f(std::type_identity<GeneratorSetting>());
    case TopicId::kHealth:
      break;
  }
  return f(std::type_identity<Health>());
}

/// The role of the topic of that name on the bus, as "fulcrum/ToolState"; null: not one of ours.
[[nodiscard]] const TopicRole* RoleNamed(std::string_view name);

/// "ToolState": the topic's name for people.
[[nodiscard]] std::string_view TopicLabel(TopicId id);

/// The stamp of a message, wherever T keeps it.
template <class T>
[[nodiscard]] const Stamp& StampOf(const T& message) {
  if constexpr (requires { message.header.stamp; }) {
    return message.header.stamp;
  } else {
    return message.stamp;
  }
}

}  // namespace fulcrum::bus
