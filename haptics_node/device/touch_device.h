// A Touch as HapticDevice: units, the map to the world, and fading of the force when the device is lost or hot.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/device/touch_driver.h"
#include "haptics_node/device/workspace_map.h"

namespace fulcrum::haptics {

/// A device without a reading for kTouchStale_s is lost: its force fades within kTouchFade_s, the tool keeps its place.
/// After reconnection the tool glides and turns to the hand within kTouchGlide_s, then the force rises within
/// kTouchRise_s.
inline constexpr double kTouchStale_s = 0.02, kTouchFade_s = 0.3, kTouchGlide_s = 0.5, kTouchRise_s = 0.25;
/// Range of the hottest motor's heat over which the force is reduced from full to 0 (at 1 the driver cuts the force).
/// Forces below the device's continuous limit do not reach it.
inline constexpr double kMotorWarm = 0.7, kMotorHot = 0.95;
/// Rate limit of the force share that depends on heat [1/s], so that the hand feels no step.
inline constexpr double kThermalRate_per_s = 1.0;

class TouchDevice final : public HapticDevice {
 public:
  /// @param parked_W attach point until the first reading of the device [m].
  TouchDevice(std::shared_ptr<TouchDriver> driver, std::size_t tool, const WorkspaceMap& map, double force_scale,
              const Vec3d& parked_W);

  [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override;
  /// Rotation of the stylus about its axis, continuous; held while the device is lost.
  [[nodiscard]] float ReadRoll() const noexcept override { return static_cast<float>(roll_); }
  /// None while the device is lost.
  [[nodiscard]] std::uint8_t ReadButtons() const noexcept override {
    return present_ ? static_cast<std::uint8_t>(sample_.buttons) : std::uint8_t{0};
  }
  void WriteForce(const Vec3d& f_W) noexcept override;
  [[nodiscard]] DeviceHealth Describe() const override;
  /// Serial number of the device with which the trocar of the map was measured; another one is a trouble of Describe().
  /// Empty: not measured.
  void set_trocar_device(std::string serial) { trocar_device_ = std::move(serial); }

 private:
  void TrackPresence(bool present, double dt) noexcept;
  void TrackHeat(double dt) noexcept;
  void TrackRoll() noexcept;

  std::shared_ptr<TouchDriver> driver_;
  std::size_t tool_;
  WorkspaceMap map_;
  double force_scale_;
  std::string trocar_device_;

  // Servo thread.
  TouchSample sample_;
  std::int64_t sample_ns_ = 0, tick_ns_ = 0;
  bool has_reading_ = false, present_ = false;
  Vec3d position_W_;
  Vec3d offset_W_ = Vec3d::Zero();  ///< From the hand to the tool at the time of reconnection [m].
  double glide_ = 0;                ///< Remaining fraction of the offset, before smoothing, 1 … 0.
  double presence_ = 0, coolness_ = 1;
  double roll_ = 0;                         ///< Of the tool [rad].
  double hand_roll_ = 0, roll_offset_ = 0;  ///< Of the stylus, and from it to the tool as offset_W_ [rad].
  std::atomic<double> gain_{0};
};

}  // namespace fulcrum::haptics
