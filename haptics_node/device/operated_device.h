// A device for an operator without one: a hand as in the simulated device, whose intended place comes from
// OperatorInput. The hand is a spring and a damper, so the tissue's resistance shows as lag and lean of the tool.
#pragma once

#include <cstdint>

#include "haptics_node/device/hand_model.h"
#include "haptics_node/device/haptic_device.h"
#include "haptics_node/kinematics/trocar.h"

namespace fulcrum::haptics {

class OperatedDevice final : public HapticDevice {
 public:
  /// @param start attach point at which the tool rests until it is operated [m].
  OperatedDevice(const HandModel& hand, const Trocar& trocar, const Vec3d& start);

  /// Share of the force that reaches the hand, 0 … 1.
  void set_force_scale(double scale) { force_scale_ = scale; }

  /// Takes the newest sample of the present operator for this tool. Servo thread. @param stamp_ns CLOCK_MONOTONIC [ns].
  void Follow(const OperatorTool& intention, std::int64_t stamp_ns) noexcept;

  /// While the operator is silent for kOperatorSilence_ns or does not operate the tool, the hand lets go: the tissue
  /// pushes the tool until its force has vanished.
  [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override;
  [[nodiscard]] float ReadRoll() const noexcept override { return roll_; }
  void WriteForce(const Vec3d& f_W) noexcept override { force_ = force_scale_ * f_W; }

 private:
  HandOnDevice hand_;
  Trocar trocar_;
  double force_scale_ = 1;
  float roll_ = 0;
  OperatorTool intention_;
  std::int64_t intention_ns_ = 0;
  std::int64_t stamp_ns_ = 0;  ///< Of the last tick; 0: none yet.
  Vec3d force_ = Vec3d::Zero();
};

}  // namespace fulcrum::haptics
