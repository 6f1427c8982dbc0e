#include "services/base/core/messages.h"

namespace fulcrum {

const char* NodeName(NodeId node) {
  switch (node) {
    case NodeId::kSupervisor:
      return "supervisor";
    case NodeId::kHandleBridge:
      return "handle_bridge";
    case NodeId::kHaptics:
      return "haptics_node";
    case NodeId::kPhysics:
      return "physics_node";
    case NodeId::kThermal:
      return "thermal_node";
    case NodeId::kRender:
      return "render_node";
    case NodeId::kRecorder:
      return "recorder";
  }
  return "unknown";
}

}  // namespace fulcrum
