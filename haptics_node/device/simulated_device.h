// A device with an operator's hand on it: mass, spring and damper that follow the scripted tip in session time, pushed
// by the force sent. Stateless apart from session time: it begins at rest where the script is.
#pragma once

#include <cstdint>
#include <span>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/servo/trocar.h"
#include "services/core/scene_view.h"

namespace fulcrum::haptics {

/// Moving mass of a desktop device such as the Touch, at the attach point [kg].
inline constexpr double kDeviceMass_kg = 0.045;

class SimulatedDevice final : public HapticDevice {
 public:
  /// @param script keys of all tools, as in the scene; it must outlive the device. A tool without keys rests with half
  /// its shaft inside, pointing at the origin of W.
  SimulatedDevice(const HapticsParams& hand, const Trocar& trocar, std::span<const ScriptKey> script,
                  std::uint32_t tool);

  [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override;
  void WriteForce(const Vec3d& f_W) noexcept override { force_ = f_W; }

 private:
  /// The attach point that the operator wants at this session time.
  [[nodiscard]] Vec3d Target(double session_time_s) const noexcept;

  double mass_kg_, stiffness_N_m_, damping_Ns_m_;
  Trocar trocar_;
  std::span<const ScriptKey> script_;
  std::uint32_t tool_;

  bool placed_ = false;
  double session_time_s_ = 0;
  std::int64_t stamp_ns_ = 0;
  Vec3d position_ = Vec3d::Zero(), velocity_ = Vec3d::Zero(), target_ = Vec3d::Zero(), force_ = Vec3d::Zero();
};

}  // namespace fulcrum::haptics
