// Smoothness of one movement.
#pragma once

#include <span>

namespace fulcrum::assessment {

/// Spectral arc length (SPARC): minus the arc length of the magnitude of the speed profile's Fourier spectrum, scaled
/// to 1 at frequency 0, over the frequency, scaled to [0, 1]. The range ends at the last frequency up to 10 Hz whose
/// magnitude is 0.05 or more. It is about -1.4 for a minimum-jerk reach of any length and duration, and lower for
/// jerkier movements. It is used instead of the dimensionless jerk, because noise and slow starts change it little.
///
/// S. Balasubramanian, A. Melendez-Calderon, A. Roby-Brami, E. Burdet, "On the analysis of movement smoothness",
/// J. NeuroEngineering and Rehabilitation 12:112 (2015), eq. 6 and its reference code (zero-padding level 4).
///
/// @param speed samples at `rate_Hz`, at least 2, not all zero; else NaN.
[[nodiscard]] double SpectralArcLength(std::span<const double> speed, double rate_Hz);

}  // namespace fulcrum::assessment
