// Limits of single precision that kernels and the code around them share. Constants only: kernels include this file.
#pragma once

namespace fulcrum::physics {

/// Bound of the finite values in use, just below the largest float (3.403e38): `x < kLargestFinite` fails for infinity
/// and NaN. Also the neutral start of a minimum and, as a distance, "none".
inline constexpr float kLargestFinite = 3e38f;
/// Least divisor of a quotient whose numerator vanishes with its denominator (no length, no mass): 0 / kLeastDivisor is
/// 0 where 0 / 0 is NaN. Far below any length [m] and any sum of inverse masses [1/kg] that occurs, and large enough
/// for its inverse to be finite.
inline constexpr float kLeastDivisor = 1e-30f;

inline constexpr float kPi = 3.14159265f;     ///< [rad]
inline constexpr float kTwoPi = 6.28318531f;  ///< [rad]

}  // namespace fulcrum::physics
