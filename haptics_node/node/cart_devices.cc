#include "haptics_node/node/cart_devices.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "haptics_node/device/operated_device.h"
#include "haptics_node/device/simulated_device.h"
#include "haptics_node/device/touch_device.h"
#include "haptics_node/node/trocar_store.h"
#include "services/base/config/operation.h"
#include "services/base/core/operator_script.h"

namespace fulcrum::haptics {
namespace {

using config::DeviceConfig;
using config::DeviceKind;
using config::HandHold;

HandModel HandOf(HandHold hold, const HapticsParams& scene) {
  switch (hold) {
    case HandHold::kFingertip:
      return kFingertip;
    case HandHold::kLightGrip:
      return kLightGrip;
    case HandHold::kFirmGrip:
      return kFirmGrip;
    case HandHold::kScene:
      break;
  }
  return scene;
}

/// @param serial serial number of the connected device; empty if unknown or simulated.
/// @param measured_with set to the serial number with which the stored trocar was measured, if that is used.
WorkspaceMap MapOf(const config::CartConfig& cart, std::size_t tool, const Vec3d& p_WP, const std::string& serial,
                   const std::filesystem::path& trocars, std::vector<std::string>* notes,
                   std::string* measured_with = nullptr) {
  const config::WorkspaceConfig& workspace = cart.devices[tool].workspace;
  WorkspaceMap map{RotationFromAngles(workspace.rotation_rad), workspace.scale, workspace.trocar_D, p_WP};
  const std::filesystem::path file = TrocarFile(trocars, cart.name, tool);
  const std::string prefix = "tool " + std::to_string(tool) + ": ";
  if (const auto stored = LoadTrocar(file)) {
    if (serial.empty() || stored->serial == serial) {
      map.p_DP = stored->p_DP;
      if (measured_with != nullptr) *measured_with = stored->serial;
      notes->push_back(prefix + "trocar as measured, " + file.string());
    } else {
      notes->push_back(prefix + "the trocar of the cart file is used: " + file.string() + " was measured with device " +
                       stored->serial + ", this is " + serial + "; calibrate the trocar again");
    }
  }
  return map;
}

std::unique_ptr<SimulatedDevice> MakeSimulated(const DeviceConfig& device, const SceneView& scene, std::uint32_t tool,
                                               const WorkspaceMap& map) {
  const HandModel hand = HandOf(device.hand, scene.haptics);
  auto made = device.motion.empty()
                  ? MakeScriptedDevice(scene, tool, hand)
                  : std::make_unique<SimulatedDevice>(
                        hand, std::make_shared<const RecordedMotion>(RecordedMotion::Load(device.motion)), map);
  made->set_force_scale(device.force_scale);
  return made;
}

/// First pose of the tool in the scene's script whose tip the laparoscope sees, well inside the picture; without one
/// the first pose. An operator who cannot see the tool cannot find it.
ScriptPoint FirstInView(const SceneView& scene, std::uint32_t tool) {
  constexpr double kStep_s = 0.05;
  constexpr float kInside = 0.7f, kRadPerDeg = 0.0174532925f;
  const RenderParams& scope = scene.render;
  const float widest = std::cos(0.5f * kInside * kRadPerDeg * scope.fov_deg);
  const Vec3f sight = (scope.scope_target_W - scope.scope_tip_W).normalized();
  double end_s = 0;
  for (const ScriptKey& key : scene.script) end_s = std::max(end_s, static_cast<double>(key.time_s));
  ScriptPoint first = EvaluateScript(scene.script, tool, 0);
  if (!first.present || scene.tools[tool].kind == ToolKind::kScope) return first;
  for (double time_s = 0; time_s <= end_s; time_s += kStep_s) {
    ScriptPoint point = EvaluateScript(scene.script, tool, time_s);
    if (sight.dot((point.p_W - scope.scope_tip_W).normalized()) > widest) return point;
  }
  return first;
}

}  // namespace

std::shared_ptr<TouchDriver> MakeTouchDriver(const config::CartConfig& cart, const std::array<bool, kMaxTools>& used,
                                             const std::string& touch_library) {
  TouchDriver::WantedByTool wanted;
  for (std::size_t tool = 0; tool < wanted.size(); ++tool) {
    const DeviceConfig& device = cart.devices[tool];
    if (used[tool] && device.kind == DeviceKind::kTouch) wanted[tool] = {device.name, device.serial};
  }
  if (std::none_of(wanted.begin(), wanted.end(), [](const auto& want) { return want.has_value(); })) return nullptr;
  return std::make_shared<TouchDriver>(wanted, touch_library);
}

CartDevices MakeCartDevices(const config::CartConfig& cart, const SceneView& scene,
                            const std::filesystem::path& trocars, const std::string& touch_library) {
  std::array<bool, kMaxTools> used{};
  std::transform(scene.tools.begin(), scene.tools.end(), used.begin(),
                 [](const ToolDescription& tool) { return tool.kind != ToolKind::kNone; });
  const std::shared_ptr<TouchDriver> driver = MakeTouchDriver(cart, used, touch_library);
  CartDevices made;
  made.touch = driver;
  const bool by_person = config::MovedByPerson(cart, scene.tools);
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    const DeviceConfig& device = cart.devices[i];
    if (!used[i]) continue;
    const Trocar trocar{scene.tools[i].p_WP.cast<double>(), scene.tools[i].shaft_length_m};
    // No operator's input moves an assistant.
    const bool assists = scene.tools[i].assists();
    switch (assists && device.kind == DeviceKind::kOperator ? DeviceKind::kSimulated : device.kind) {
      case DeviceKind::kNone:
        break;
      case DeviceKind::kSimulated: {
        const WorkspaceMap map =
            device.motion.empty() ? WorkspaceMap() : MapOf(cart, i, trocar.p_WP, "", trocars, &made.notes);
        auto simulated = MakeSimulated(device, scene, i, map);
        if (assists && by_person && device.motion.empty()) simulated->set_script_end(LastHoldOf(scene.script, i));
        made.devices[i] = std::move(simulated);
        break;
      }
      case DeviceKind::kOperator: {
        // The rest of the script is the simulated operator's.
        const ScriptPoint first = FirstInView(scene, i);
        const Vec3d start = first.present ? AttachPointForTip(trocar, first.p_W.cast<double>()) : RestOf(scene, i);
        auto operated = std::make_unique<OperatedDevice>(HandOf(device.hand, scene.haptics), trocar, start);
        operated->set_force_scale(device.force_scale);
        made.notes.push_back("tool " + std::to_string(i) + ": moved by the operator's input");
        made.devices[i] = std::move(operated);
        break;
      }
      case DeviceKind::kTouch: {
        const std::string found = driver->serial(i), trouble = driver->Trouble(i);
        const std::string& serial = found.empty() ? device.serial : found;
        std::string measured_with;
        const WorkspaceMap map = MapOf(cart, i, trocar.p_WP, serial, trocars, &made.notes, &measured_with);
        made.notes.push_back("tool " + std::to_string(i) + ": " + (trouble.empty() ? "Touch " + serial : trouble));
        auto touch = std::make_unique<TouchDevice>(driver, i, map, device.force_scale, RestOf(scene, i));
        // A device that is connected later tells its number only then.
        touch->set_trocar_device(measured_with);
        made.devices[i] = std::move(touch);
        break;
      }
    }
  }
  return made;
}

}  // namespace fulcrum::haptics
