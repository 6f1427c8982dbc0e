// The gate: conditions that a message must satisfy before a node receives it. Every backend applies it on the reading
// side, so a message with a NaN, a count beyond its array or an unknown enumerator is dropped and counted, never used.
#pragma once

#include "services/base/core/messages.h"

namespace fulcrum::bus {

/// No coordinate of the operating field lies further from the origin of W than this [m].
inline constexpr float kMaxCoordinate_m = 10.0f;
/// No tool, hand or tissue moves faster than this [m/s].
inline constexpr float kMaxSpeed_m_s = 100.0f;
/// No tool turns faster than this [rad/s].
inline constexpr float kMaxTurnRate_rad_s = 1000.0f;
/// No force between tool and tissue exceeds this [N].
inline constexpr float kMaxForce_N = 1000.0f;
/// A jaw opens to about 1.05 rad; a miscalibrated one may read somewhat more [rad].
inline constexpr float kMaxJawAngle_rad = 3.2f;
inline constexpr float kMaxRoll_rad = 6.3f;
/// Largest magnitude of a stiffness, viscosity or curvature; beyond it the number is an accident [SI].
inline constexpr float kMaxCoefficient = 1e12f;
/// Coldest and hottest tissue; arcs heat char to about 1000 °C.
inline constexpr float kMinTemperature_C = -50.0f;
inline constexpr float kMaxTemperature_C = 3000.0f;
/// Largest generator power [W].
inline constexpr float kMaxPower_W = 1000.0f;
/// Room for rounding in unit normals, unit quaternions and barycentric sums held in single precision.
inline constexpr float kUnitTolerance = 1e-2f;

/// Largest number of inputs in a TickManifest. thermal_node has the most: eight contacts, for each two HandleStates and
/// a GeneratorSetting; a TearState.
inline constexpr std::size_t kMaxConsumedInputs = 33;
inline constexpr std::size_t kMaxTickTimes = 10;
inline constexpr std::size_t kMaxInputHealths = 16;
inline constexpr std::size_t kMaxMetrics = 28;
inline constexpr std::size_t kMaxMetricName = 31;
inline constexpr std::size_t kMaxSceneName = 63;
inline constexpr std::size_t kMaxSessionId = 63;
/// Health.last_error, a text for people, is cut to this length when sent, not refused [B].
inline constexpr std::size_t kMaxErrorText = 255;

// Defined for each message; a message without a definition does not link.
#define FULCRUM_GATE(T) [[nodiscard]] bool PassesGate(const T& m) noexcept;
FULCRUM_MESSAGES(FULCRUM_GATE)
#undef FULCRUM_GATE

}  // namespace fulcrum::bus
