#include "services/session/supervisor/script_outlook.h"

#include <algorithm>

#include "services/base/core/operator_script.h"

namespace fulcrum::supervisor {
namespace {

// A grasp deforms the tissue within a second; before a cut appears, the hook must heat and dry tissue and move on.
constexpr double kTimeToDeform = 2.0;
constexpr double kTimeToCut = 3.0;

constexpr double kSpeedSpan = 0.1;       // Central difference for the tool's speed [s].
constexpr double kMovingSpeed = 2.0e-3;  // A slower tool counts as holding [m/s].

/// Session time of the tool's next key, at which the pedals of this one end.
double EndOfKey(const SceneView& scene, const ScriptKey& key, double end_s) {
  for (const ScriptKey& next : scene.script) {
    if (next.tool == key.tool && next.time_s > key.time_s) end_s = std::min(end_s, static_cast<double>(next.time_s));
  }
  return end_s;
}

bool IsCutting(const ScriptPoint& point) { return point.pedals != kPedalNone && point.power_W > 0; }

}  // namespace

std::string PhaseAt(const SceneView& scene, double time) {
  if (scene.script.empty()) {
    return {};
  }
  std::string phase = "approach";
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    const ScriptPoint now = EvaluateScript(scene.script, tool, time);
    if (!now.present) {
      continue;
    }
    if (IsCutting(now)) {
      return (now.pedals & kPedalCoag) != 0 ? "coagulate" : "cut";
    }
    if (scene.tools[tool].kind != ToolKind::kGrasper) {
      continue;
    }
    const float close = scene.physics.grasp_close_rad;
    if (now.jaw_rad < close) {
      const ScriptPoint before = EvaluateScript(scene.script, tool, time - kSpeedSpan);
      const ScriptPoint after = EvaluateScript(scene.script, tool, time + kSpeedSpan);
      const double speed = static_cast<double>((after.p_W - before.p_W).norm()) / (2 * kSpeedSpan);
      phase = speed > kMovingSpeed ? "pull" : "hold";
      continue;
    }
    for (const ScriptKey& key : scene.script) {
      if (key.tool == tool && static_cast<double>(key.time_s) <= time && key.jaw_rad < close) {
        phase = "release";
      }
    }
    const ScriptPoint soon = EvaluateScript(scene.script, tool, time + 0.5);
    if (phase == "approach" && soon.jaw_rad < now.jaw_rad) {
      phase = "grasp";
    }
  }
  return phase;
}

ScriptDemands DemandsUntil(const SceneView& scene, double end_s) {
  ScriptDemands demands;
  for (const ScriptKey& key : scene.script) {
    const double left = end_s - static_cast<double>(key.time_s);
    const bool heating = key.pedals != kPedalNone && key.power_W > 0;
    const bool grasping =
        scene.tools[key.tool].kind == ToolKind::kGrasper && key.jaw_rad < scene.physics.grasp_close_rad;
    demands.deformation |= (heating || grasping) && left >= kTimeToDeform;
    demands.grasp |= grasping && left >= kTimeToDeform;
    // Coag opens nothing, of the tools only the hook has current, and only sheets are cut.
    const bool cutting = heating && (key.pedals & (kPedalCut | kPedalBlend)) != 0 &&
                         scene.tools[key.tool].kind == ToolKind::kHook && scene.membrane.node_count() > 0;
    if (!cutting || left < kTimeToCut) continue;
    demands.cut = true;
    demands.cutting.push_back({static_cast<double>(key.time_s), EndOfKey(scene, key, end_s)});
  }
  return demands;
}

ScriptDemands PossibleDemands(ScriptDemands demands, std::uint32_t node_mask, const config::CartConfig& cart) {
  const auto all_run = [&](std::initializer_list<NodeId> nodes) {
    return std::all_of(nodes.begin(), nodes.end(),
                       [&](NodeId node) { return (node_mask >> static_cast<unsigned>(node) & 1u) != 0; });
  };
  using enum NodeId;
  // Jaws and pedals come from handle_bridge, poses from haptics_node.
  const bool tools_move =
      all_run({kHandleBridge, kHaptics, kPhysics}) &&
      std::all_of(cart.devices.begin(), cart.devices.end(),
                  [](const config::DeviceConfig& device) {
                    return device.kind == config::DeviceKind::kSimulated && device.motion.empty();
                  }) &&
      std::none_of(cart.handles.begin(), cart.handles.end(),
                   [](const config::HandleConfig& handle) { return handle.kind == config::LinkKind::kSerial; });
  demands.deformation = demands.deformation && tools_move;
  demands.cut = demands.cut && tools_move && all_run({kThermal}) && cart.pedal.kind == config::LinkKind::kSimulated;
  return demands;
}

}  // namespace fulcrum::supervisor
