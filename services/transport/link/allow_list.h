// The only samples that cross the link: each side may write the topics of its own nodes and nothing else. Commands
// never travel.
#pragma once

#include <cstdint>
#include <optional>

#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/far_participant.h"

namespace fulcrum::link {

/// Topics that may cross in one direction or the other. A topic that is not listed here never does. Pictures do not: a
/// link that reads them would make render_node compress all the time, and they would fill a slow cable.
inline constexpr bus::TopicSet kTravels =
    bus::SetOf(TopicId::kHandleState, TopicId::kToolState, TopicId::kTissueFrame, TopicId::kContactModel,
               TopicId::kCauteryContact, TopicId::kTearState, TopicId::kClipState, TopicId::kOpenCells,
               TopicId::kTopologyState, TopicId::kTemperaturePatch, TopicId::kThermalEvent, TopicId::kSceneManifest,
               TopicId::kGeneratorSetting, TopicId::kOperatorInput, TopicId::kTickManifest, TopicId::kHealth);

/// The side of the link on which a rule is applied.
struct Side {
  bus::FarSide here = bus::FarSide::kCart;
  std::uint32_t native = ~0u;  ///< Bit per NodeId: nodes of this host, and what the session itself consists of.

  [[nodiscard]] constexpr bool IsNative(NodeId node) const { return (native >> static_cast<unsigned>(node) & 1u) != 0; }
  /// Whether samples of the topic may be sent from here.
  [[nodiscard]] constexpr bool MayLeave(TopicId topic) const {
    return MayCross(topic, true, here == bus::FarSide::kHost);
  }
  /// Whether samples of the topic may arrive here.
  [[nodiscard]] constexpr bool MayArrive(TopicId topic) const {
    return MayCross(topic, false, here == bus::FarSide::kCart);
  }
  /// Whether a sample that names its node may arrive here. Any number: it was received.
  [[nodiscard]] constexpr bool MayArriveOf(NodeId node) const {
    return static_cast<unsigned>(node) < static_cast<unsigned>(kNodeCount) && !IsNative(node);
  }

 private:
  /// @param native_owner whether the topic's owner must run here. @param ticks whether TickManifest crosses in this
  /// direction: only to the cart, whose recorder reads it.
  [[nodiscard]] constexpr bool MayCross(TopicId topic, bool native_owner, bool ticks) const {
    if (!bus::Contains(kTravels, topic)) return false;
    // Messages of several nodes name their node.
    if (topic == TopicId::kHealth) return true;
    if (topic == TopicId::kTickManifest) return ticks;
    const std::optional<NodeId> owner = bus::OwnerOf(topic);
    return owner && IsNative(*owner) == native_owner;
  }
};

}  // namespace fulcrum::link
