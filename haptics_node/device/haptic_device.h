// What the servo sees of a haptic device.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "services/base/core/messages.h"
#include "services/base/core/tick.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics {

/// What Health says of a device.
struct DeviceHealth {
  double motor_heat = -1;  ///< Hottest motor, 0 cold … 1 the driver cuts the force; negative: not measured.
  double gain = 1;         ///< Share of the force that reaches the hand, 0 … 1.
  std::string trouble;     ///< What is wrong and what to check; empty when all is well.
};

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;
  /// Where the attach point of the tool is now, in frame W [m]. Once per tick, on the servo thread: does not wait,
  /// lock or allocate.
  [[nodiscard]] virtual Vec3d ReadPosition(const Tick& tick) noexcept = 0;
  /// Force on the hand at the attach point, in frame W [N], held until the next call.
  virtual void WriteForce(const Vec3d& f_W) noexcept = 0;
  /// Any thread but the servo's.
  [[nodiscard]] virtual DeviceHealth Describe() const { return {}; }
};

/// By tool; null for a tool without device.
using DeviceArray = std::array<std::unique_ptr<HapticDevice>, kMaxTools>;

}  // namespace fulcrum::haptics
