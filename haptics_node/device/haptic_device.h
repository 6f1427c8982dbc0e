// What the servo sees of a haptic device.
#pragma once

#include "services/core/tick.h"
#include "services/core/types.h"

namespace fulcrum::haptics {

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;
  /// Where the attach point of the tool is now, in frame W [m]. Once per tick, on the servo thread: does not wait,
  /// lock or allocate.
  [[nodiscard]] virtual Vec3d ReadPosition(const Tick& tick) noexcept = 0;
  /// Force on the hand at the attach point, in frame W [N], held until the next call.
  virtual void WriteForce(const Vec3d& f_W) noexcept = 0;
};

}  // namespace fulcrum::haptics
