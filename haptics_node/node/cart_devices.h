// From a cart's description to devices.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/device/touch_driver.h"
#include "haptics_node/device/workspace_map.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::haptics {

/// Library of the Touch's driver, as the loader finds it.
inline constexpr const char* kTouchLibrary = "libHD.so";

struct CartDevices {
  DeviceArray devices;
  std::shared_ptr<TouchDriver> touch;  ///< Behind the Touch devices; null without. Start() its maintenance.
  std::vector<std::string> notes;      ///< What was found and which trocars are in use, a line each, for the log.
};

/// Opens what the cart names for the tools of the scene; a trocar in `trocars` stands above the cart's own, unless
/// another device measured it. Throws InputError.
[[nodiscard]] CartDevices MakeCartDevices(const config::CartConfig& cart, const SceneView& scene,
                                          const std::filesystem::path& trocars,
                                          const std::string& touch_library = kTouchLibrary);

/// The driver of the cart's Touch devices, restricted to tools for which `used` is true; null when there is none.
[[nodiscard]] std::shared_ptr<TouchDriver> MakeTouchDriver(const config::CartConfig& cart,
                                                           const std::array<bool, kMaxTools>& used,
                                                           const std::string& touch_library);

}  // namespace fulcrum::haptics
