// Conditions that a contact model must satisfy before the servo renders it. The bus has already dropped values that are
// not finite or far out of range; this gate checks the narrower ranges within which the servo is known to be stable.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum::haptics {

inline constexpr float kMaxSkinStiffness_N_m = 2e4f;  ///< k1 and kt.
inline constexpr float kMinSkinStiffness_N_m = 1.0f;  ///< k1: the stretch under a force is f / k1.
inline constexpr float kMaxCubicStiffness = 1e12f;    ///< k3 [N/m^3].
inline constexpr float kMinBodyStiffness_N_m = 10.0f;
inline constexpr float kMaxBodyStiffness_N_m = 2e5f;
inline constexpr float kMaxBodyViscosity_Ns_m = 2e3f;
inline constexpr float kMaxFriction = 2.0f;
inline constexpr float kMaxReferenceForce_N = 20.0f;
inline constexpr float kUnitNormalTolerance = 0.01f;
inline constexpr float kMaxCurvature_per_m = 2e3f;  ///< A radius of half a millimetre.
inline constexpr float kMaxLength_m = 1.0f;         ///< Limit of gaps, displacements and radii.
inline constexpr float kMaxRate_m_s = 10.0f;
inline constexpr float kMaxPlace_m = 10.0f;
inline constexpr float kMaxExternalPower_W = 0.05f;
/// A message may be stamped this much later than the start of the tick that reads it [ns].
inline constexpr std::int64_t kClockSlack_ns = 10'000'000;

/// Ranges of one contact, each number finite.
[[nodiscard]] bool IsRenderable(const Contact& contact) noexcept;

/// Checks the order of the stream: sequence and time must increase within an epoch, and epochs must not decrease.
class ModelGate {
 public:
  /// Returns true if the model may be rendered; otherwise it is dropped and counted.
  [[nodiscard]] bool Admit(const ContactModel& model, std::int64_t now_ns) noexcept;
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  [[nodiscard]] bool IsInOrder(const ContactModel& model, std::int64_t now_ns) const noexcept;

  std::uint64_t epoch_ = 0, sequence_ = 0;
  std::int64_t stamp_ns_ = 0, tool_stamp_ns_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace fulcrum::haptics
