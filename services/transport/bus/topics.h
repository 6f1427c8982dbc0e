// All topic names, and the roles that determine their quality of service. Depths are named by their purpose: how many
// samples the slowest reader must find between two reads, and how many a late joiner receives.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <type_traits>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

enum class Path : std::uint8_t {
  kLoopback,      ///< UDP on 127.0.0.1, serialised.
  kSharedMemory,  ///< Data-sharing with loans, at most 100 Hz.
};

enum class Delivery : std::uint8_t {
  kBestEffort,
  kReliable,
};

/// Quality of service of a topic.
struct Quality {
  Path path = Path::kLoopback;
  Delivery delivery = Delivery::kBestEffort;
  /// A late joiner receives the newest `writer_depth` samples of each live writer.
  bool late_joiners_served = false;
  /// A gap in the sequence is a loss. False where the ring is overwritten on purpose because only the newest counts.
  bool gap_is_loss = true;
  int writer_depth = 1;
  int reader_depth = 1;
};

struct TopicRole {
  TopicId id;
  const char* name;
  Quality quality;
  /// One process at a time publishes the topic: once a later epoch was received, samples of earlier ones are refused.
  [[nodiscard]] constexpr bool one_owner() const {
    return id != TopicId::kTickManifest && id != TopicId::kHealth && id != TopicId::kOperatorInput;
  }
  /// In a recording. A picture is not: a replay draws it again, and a reader would make render_node compress.
  [[nodiscard]] constexpr bool recorded() const { return id != TopicId::kPicture; }
};

// Reader depths cover the slowest reader of a topic between two reads: a software frame on a loaded machine takes up to
// a second, which is 1000 ToolStates of 168 bytes. A gap therefore means a real loss and not a slow reader. Topics with
// several writers have no keys (keys rule out data-sharing and cost a lookup): their readers are deep enough for
// simultaneous bursts of all writers.
inline constexpr int kLatestOnly = 1;
inline constexpr int kStreamAtSlowestReader = 1024;
inline constexpr int kFrameRing = 4;
/// Samples that a restarted reader has missed: more than half a second of a stream of 100 Hz.
inline constexpr int kOutage = 64;
/// Each patch belongs to one slot of the atlas, so a renderer at 15 Hz needs every one of the 60 Hz stream.
inline constexpr int kPatchRing = 16;
inline constexpr int kEventBurst = 512;
inline constexpr int kAllWriters = 64;

/// Role of the topic of a message type; a type without a role does not compile.
template <class T>
extern const Quality kQualityOf;
template <>
inline constexpr Quality kQualityOf<HandleState>{.writer_depth = kLatestOnly, .reader_depth = kStreamAtSlowestReader};
template <>
inline constexpr Quality kQualityOf<ToolState>{.writer_depth = kLatestOnly, .reader_depth = kStreamAtSlowestReader};
template <>
inline constexpr Quality kQualityOf<TissueFrame>{.path = Path::kSharedMemory,
                                                 .late_joiners_served = true,
                                                 .gap_is_loss = false,
                                                 .writer_depth = kFrameRing,
                                                 .reader_depth = kFrameRing};
template <>
inline constexpr Quality kQualityOf<ContactModel>{.writer_depth = kLatestOnly, .reader_depth = kStreamAtSlowestReader};
template <>
inline constexpr Quality kQualityOf<CauteryContact>{.delivery = Delivery::kReliable,
                                                    .late_joiners_served = true,
                                                    .writer_depth = kOutage,
                                                    .reader_depth = kStreamAtSlowestReader};
template <>
inline constexpr Quality kQualityOf<TopologyState>{.delivery = Delivery::kReliable,
                                                   .late_joiners_served = true,
                                                   .gap_is_loss = false,
                                                   .writer_depth = kLatestOnly,
                                                   .reader_depth = kFrameRing};
template <>
inline constexpr Quality kQualityOf<TemperaturePatch>{
    .path = Path::kSharedMemory, .late_joiners_served = true, .writer_depth = kPatchRing, .reader_depth = kPatchRing};
template <>
inline constexpr Quality kQualityOf<ThermalEvent>{
    .delivery = Delivery::kReliable, .writer_depth = kEventBurst, .reader_depth = kEventBurst};
template <>
inline constexpr Quality kQualityOf<SceneManifest>{.delivery = Delivery::kReliable,
                                                   .late_joiners_served = true,
                                                   .gap_is_loss = false,
                                                   .writer_depth = kLatestOnly,
                                                   .reader_depth = kFrameRing};
template <>
inline constexpr Quality kQualityOf<TickManifest>{
    .delivery = Delivery::kReliable, .writer_depth = kEventBurst, .reader_depth = kEventBurst};
template <>
inline constexpr Quality kQualityOf<Health>{.delivery = Delivery::kReliable,
                                            .late_joiners_served = true,
                                            .writer_depth = kLatestOnly,
                                            .reader_depth = kAllWriters};
template <>
inline constexpr Quality kQualityOf<TearState>{.delivery = Delivery::kReliable,
                                               .late_joiners_served = true,
                                               .gap_is_loss = false,
                                               .writer_depth = kLatestOnly,
                                               .reader_depth = kFrameRing};
template <>
inline constexpr Quality kQualityOf<OpenCells>{.delivery = Delivery::kReliable,
                                               .late_joiners_served = true,
                                               .gap_is_loss = false,
                                               .writer_depth = kLatestOnly,
                                               .reader_depth = kFrameRing};
template <>
inline constexpr Quality kQualityOf<ClipState>{.delivery = Delivery::kReliable,
                                               .late_joiners_served = true,
                                               .gap_is_loss = false,
                                               .writer_depth = kLatestOnly,
                                               .reader_depth = kFrameRing};
template <>
inline constexpr Quality kQualityOf<GeneratorSetting>{.delivery = Delivery::kReliable,
                                                      .late_joiners_served = true,
                                                      .gap_is_loss = false,
                                                      .writer_depth = kLatestOnly,
                                                      .reader_depth = kOutage};
/// Sent again at 50 Hz, so a lost sample is replaced.
template <>
inline constexpr Quality kQualityOf<OperatorInput>{.writer_depth = kLatestOnly, .reader_depth = kAllWriters};

template <>
inline constexpr Quality kQualityOf<Picture>{.path = Path::kSharedMemory,
                                             .late_joiners_served = true,
                                             .gap_is_loss = false,
                                             .writer_depth = kFrameRing,
                                             .reader_depth = kFrameRing};

/// Topic of a message type.
template <class T>
struct TopicOf;
#define FULCRUM_TOPIC_OF(T)                      \
  template <>                                    \
  struct TopicOf<T> {                            \
    static constexpr TopicId id = TopicId::k##T; \
  };
FULCRUM_MESSAGES(FULCRUM_TOPIC_OF)
#undef FULCRUM_TOPIC_OF
template <class T>
inline constexpr TopicId kTopicOf = TopicOf<T>::id;

#define FULCRUM_ROLE(T) TopicRole{TopicId::k##T, "fulcrum/" #T, kQualityOf<T>},
inline constexpr std::array<TopicRole, kTopicCount> kTopicRoles{{FULCRUM_MESSAGES(FULCRUM_ROLE)}};
#undef FULCRUM_ROLE

[[nodiscard]] constexpr const TopicRole& RoleOf(TopicId id) { return kTopicRoles[static_cast<std::size_t>(id)]; }
template <class T>
[[nodiscard]] constexpr const TopicRole& RoleOf() {
  return RoleOf(kTopicOf<T>);
}
[[nodiscard]] constexpr const Quality& QualityOf(TopicId id) { return RoleOf(id).quality; }

/// Calls `f(std::type_identity<T>())` with the message type of a topic that is known at run time only.
template <class F>
decltype(auto) WithMessageOf(TopicId id, F&& f) {
#define FULCRUM_CASE(T) \
  case TopicId::k##T:   \
    return f(std::type_identity<T>());
  switch (id) { FULCRUM_MESSAGES(FULCRUM_CASE) }
#undef FULCRUM_CASE
  std::abort();  // No such id: ids from outside have passed the gate or RoleNamed before.
}

/// Role of the topic with this name on the bus, such as "fulcrum/ToolState"; nullptr: no topic of this project.
[[nodiscard]] const TopicRole* RoleNamed(std::string_view name);

/// The topic's name for people, such as "ToolState".
[[nodiscard]] std::string_view TopicLabel(TopicId id);

/// The stamp of a message, wherever T stores it.
template <class T>
[[nodiscard]] const Stamp& StampOf(const T& message) {
  if constexpr (requires { message.header.stamp; }) {
    return message.header.stamp;
  } else {
    return message.stamp;
  }
}
template <class T>
[[nodiscard]] Stamp& MutableStampOf(T* message) {
  return const_cast<Stamp&>(StampOf(*message));
}

}  // namespace fulcrum::bus
