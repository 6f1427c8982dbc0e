// A Touch as the servo sees it: units, the map to the world, and a force that fades where the device can give none.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/device/touch_driver.h"
#include "haptics_node/device/workspace_map.h"

namespace fulcrum::haptics {

/// A device that has given no reading for this long is gone: its force fades within kTouchFade_s, the tool stays where
/// it is. When it is back the tool glides to the hand within kTouchGlide_s, then the force rises within kTouchRise_s.
inline constexpr double kTouchStale_s = 0.02, kTouchFade_s = 0.3, kTouchGlide_s = 0.5, kTouchRise_s = 0.25;
/// Heat of the hottest motor (0 … 1, where the driver cuts the force at 1) between which the force goes down to
/// nothing. Forces below the continuous limit of the device never get there.
inline constexpr double kMotorWarm = 0.7, kMotorHot = 0.95;
/// How fast the share of the force that heat leaves may change [1/s]: nothing that a hand would feel as a step.
inline constexpr double kThermalRate_per_s = 1.0;

class TouchDevice final : public HapticDevice {
 public:
  /// @param parked_W where the attach point is until the device has spoken [m].
  TouchDevice(std::shared_ptr<TouchDriver> driver, std::size_t tool, const WorkspaceMap& map, double force_scale,
              const Vec3d& parked_W);

  [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override;
  void WriteForce(const Vec3d& f_W) noexcept override;
  [[nodiscard]] DeviceHealth Describe() const override;

 private:
  void TrackPresence(bool present, double dt) noexcept;
  void TrackHeat(double dt) noexcept;

  std::shared_ptr<TouchDriver> driver_;
  std::size_t tool_;
  WorkspaceMap map_;
  double force_scale_;

  // Servo thread.
  TouchSample sample_;
  std::int64_t sample_ns_ = 0, tick_ns_ = 0;
  bool spoken_ = false, present_ = false;
  Vec3d position_W_;
  Vec3d offset_W_ = Vec3d::Zero();  ///< From the hand to the tool when the device came back.
  double glide_ = 0;                ///< Part of the offset that is left, before smoothing, 1 … 0.
  double presence_ = 0, coolness_ = 1;
  std::atomic<double> gain_{0};
};

}  // namespace fulcrum::haptics
