// Interface of a haptic device for the servo.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "services/base/core/messages.h"
#include "services/base/core/tick.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics {

/// State of a device for Health.
struct DeviceHealth {
  double motor_heat = -1;  ///< Heat of the hottest motor: 0 cold, 1 the driver cuts the force; negative: not measured.
  double gain = 1;         ///< Share of the force that reaches the hand, 0 … 1.
  std::string trouble;     ///< Fault and what to check; empty without a fault.
};

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;
  /// Position of the tool's attach point, in frame W [m]. Called once per tick on the servo thread: does not wait, lock
  /// or allocate.
  [[nodiscard]] virtual Vec3d ReadPosition(const Tick& tick) noexcept = 0;
  /// Rotation of the tool about its shaft [rad], clockwise as seen from the handle; after ReadPosition of the tick,
  /// under the same conditions.
  [[nodiscard]] virtual float ReadRoll() const noexcept { return 0; }
  /// Bit per pressed button; bit 0: the one nearest to the tip. As ReadRoll.
  [[nodiscard]] virtual std::uint8_t ReadButtons() const noexcept { return 0; }
  /// Sets the force on the hand at the attach point, in frame W [N]; it is held until the next call.
  virtual void WriteForce(const Vec3d& f_W) noexcept = 0;
  /// Time until which the device stays where it is [CLOCK_MONOTONIC, ns], if the force on it stays 0; 0: unknown. As
  /// ReadRoll.
  [[nodiscard]] virtual std::int64_t RestsUntil() const noexcept { return 0; }
  /// State for Health. Call from any thread except the servo's.
  [[nodiscard]] virtual DeviceHealth Describe() const { return {}; }
};

/// Devices by tool; null for a tool without device.
using DeviceArray = std::array<std::unique_ptr<HapticDevice>, kMaxTools>;

}  // namespace fulcrum::haptics
