// Who sends a topic.
#pragma once

#include <optional>

#include "services/core/messages.h"

namespace fulcrum::bus {

/// The node that sends a topic; none for those that several nodes send.
[[nodiscard]] constexpr std::optional<NodeId> OwnerOf(TopicId topic) {
  switch (topic) {
    case TopicId::kHandleState:
      return NodeId::kHandleBridge;
    case TopicId::kToolState:
      return NodeId::kHaptics;
    case TopicId::kTissueFrame:
    case TopicId::kContactModel:
    case TopicId::kCauteryContact:
      return NodeId::kPhysics;
    case TopicId::kTopologyState:
    case TopicId::kTemperaturePatch:
    case TopicId::kThermalEvent:
      return NodeId::kThermal;
    case TopicId::kSceneManifest:
      return NodeId::kSupervisor;
    case TopicId::kCommand:
    case TopicId::kCommandReply:
    case TopicId::kTickManifest:
    case TopicId::kHealth:
      break;
  }
  return std::nullopt;
}

}  // namespace fulcrum::bus
