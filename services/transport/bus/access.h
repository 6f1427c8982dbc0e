// Rights of the participants: the one table from which the permissions of a secured cart are made
// (services/transport/keys). A port that is not listed here is refused on such a cart; the test of a whole session with
// security on checks that the table is complete (tests/integration/security).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

/// Set of topics, one bit per TopicId.
using TopicSet = std::uint32_t;
static_assert(kTopicCount <= 32);

template <class... Ids>
[[nodiscard]] constexpr TopicSet SetOf(Ids... ids) {
  return (TopicSet{0} | ... | (TopicSet{1} << static_cast<unsigned>(ids)));
}
[[nodiscard]] constexpr bool Contains(TopicSet set, TopicId id) { return (set >> static_cast<unsigned>(id) & 1u) != 0; }

struct AccessRole {
  std::string_view identity;  ///< Subject of the certificate; for a node its name.
  TopicSet writes;
  TopicSet reads;
};

/// Participants that are not nodes.
inline constexpr std::string_view kToolIdentity = "fulcrum";       ///< status, top: reads, writes nothing.
inline constexpr std::string_view kConsoleIdentity = "console";    ///< Also shows the picture and operates.
inline constexpr std::string_view kReplayerIdentity = "replayer";  ///< Writes topics of nodes: replayer --live.
inline constexpr std::string_view kLinkIdentity = "link";          ///< Writes topics of the nodes of another host.
/// Domains of carts, and of links between two hosts of one cart.
inline constexpr int kFirstCartDomain = 1, kLastCartDomain = 100, kFirstLinkDomain = 101, kLastLinkDomain = 200;
/// Topics of the link domain, which carry bytes between two hosts: by lane and by writing side.
inline constexpr std::array<std::string_view, 4> kLinkTopics{
    "fulcrum/link/stream/from_cart", "fulcrum/link/stream/from_host", "fulcrum/link/ordered/from_cart",
    "fulcrum/link/ordered/from_host"};

namespace access {
using enum TopicId;
inline constexpr TopicSet kAll = (TopicSet{1} << kTopicCount) - 1;
/// Topics that services/nodes/app writes for every node.
inline constexpr TopicSet kNodeWrites = SetOf(kHealth);
inline constexpr TopicSet kNodeReads = SetOf(kSceneManifest, kHealth);

/// Nodes first, in the order of NodeId.
inline constexpr std::array kRoles{
    AccessRole{"supervisor", SetOf(kSceneManifest, kGeneratorSetting, kHealth),
               SetOf(kThermalEvent, kHealth, kToolState, kHandleState, kContactModel, kCauteryContact, kTopologyState,
                     kTemperaturePatch)},
    AccessRole{"handle_bridge", kNodeWrites | SetOf(kHandleState), kNodeReads | SetOf(kOperatorInput, kToolState)},
    AccessRole{"haptics_node", kNodeWrites | SetOf(kToolState, kTickManifest),
               kNodeReads | SetOf(kContactModel, kOperatorInput)},
    AccessRole{"physics_node",
               kNodeWrites | SetOf(kTissueFrame, kContactModel, kCauteryContact, kTearState, kClipState, kTickManifest),
               kNodeReads | SetOf(kToolState, kHandleState, kTopologyState, kOpenCells, kTickManifest)},
    AccessRole{"thermal_node",
               kNodeWrites | SetOf(kTopologyState, kOpenCells, kTemperaturePatch, kThermalEvent, kTickManifest),
               kNodeReads | SetOf(kCauteryContact, kTearState, kHandleState, kGeneratorSetting)},
    AccessRole{
        "render_node", kNodeWrites | SetOf(kOperatorInput, kPicture),
        kNodeReads | SetOf(kTissueFrame, kTopologyState, kTemperaturePatch, kToolState, kHandleState, kThermalEvent,
                           kCauteryContact, kGeneratorSetting, kContactModel, kClipState, kOperatorInput)},
    AccessRole{"recorder", kNodeWrites, kAll},
    AccessRole{kReplayerIdentity, kAll, 0},
    AccessRole{kLinkIdentity, kAll, kAll},
    AccessRole{kToolIdentity, 0, SetOf(kSceneManifest, kThermalEvent, kHealth)},
    AccessRole{kConsoleIdentity, SetOf(kOperatorInput),
               SetOf(kSceneManifest, kThermalEvent, kHealth, kPicture, kOperatorInput)},
};
}  // namespace access

inline constexpr const auto& kAccessRoles = access::kRoles;

/// Role with that identity; nullptr: none.
[[nodiscard]] constexpr const AccessRole* AccessRoleOf(std::string_view identity) {
  for (const AccessRole& role : kAccessRoles) {
    if (role.identity == identity) return &role;
  }
  return nullptr;
}

/// Whether the participant may publish the topics of nodes.
[[nodiscard]] constexpr bool StandsIn(std::string_view identity) {
  return identity == kReplayerIdentity || identity == kLinkIdentity;
}

/// The node that publishes a topic; none if several nodes publish it. Participants that are not nodes do not count.
[[nodiscard]] constexpr std::optional<NodeId> OwnerOf(TopicId topic) {
  std::optional<NodeId> owner;
  int writers = 0;
  for (std::size_t i = 0; i < kNodeCount; ++i) {
    if (!Contains(kAccessRoles[i].writes, topic)) continue;
    ++writers;
    owner = static_cast<NodeId>(i);
  }
  return writers == 1 ? owner : std::nullopt;
}
static_assert(OwnerOf(TopicId::kSceneManifest) == NodeId::kSupervisor &&
              OwnerOf(TopicId::kToolState) == NodeId::kHaptics && OwnerOf(TopicId::kThermalEvent) == NodeId::kThermal &&
              !OwnerOf(TopicId::kHealth));

}  // namespace fulcrum::bus
