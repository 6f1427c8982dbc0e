// Creates the haptic devices that a cart describes.
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
  std::shared_ptr<TouchDriver> touch;  ///< Driver of the Touch devices, null without any. The caller must Start() it.
  std::vector<std::string> notes;      ///< Devices found and trocars in use, one line each, for the log.
};

/// Opens the devices that the cart names for the tools of the scene. A trocar stored in `trocars` takes precedence over
/// the cart's, unless it was measured with another device. Throws InputError.
[[nodiscard]] CartDevices MakeCartDevices(const config::CartConfig& cart, const SceneView& scene,
                                          const std::filesystem::path& trocars,
                                          const std::string& touch_library = kTouchLibrary);

/// The driver of the cart's Touch devices, restricted to tools for which `used` is true; null when there is none.
[[nodiscard]] std::shared_ptr<TouchDriver> MakeTouchDriver(const config::CartConfig& cart,
                                                           const std::array<bool, kMaxTools>& used,
                                                           const std::string& touch_library);

}  // namespace fulcrum::haptics
