// Smoothness of one movement.
#pragma once

#include <span>

namespace fulcrum::assessment {

/// Spectral arc length (SPARC): the length of the curve that the magnitude of the speed profile's Fourier spectrum,
/// scaled to 1 at frequency 0, draws over frequency, scaled to [0, 1], with a minus sign. Frequencies up to 10 Hz, and
/// of these up to the last whose magnitude is 0.05 or more. About -1.4 for a minimum-jerk reach of any length and
/// duration, the lower the jerkier; noise and slow starts change it little, which is why it was taken and not the
/// dimensionless jerk.
///
/// S. Balasubramanian, A. Melendez-Calderon, A. Roby-Brami, E. Burdet, "On the analysis of movement smoothness",
/// J. NeuroEngineering and Rehabilitation 12:112 (2015), eq. 6 and its reference code (zero-padding level 4).
///
/// @param speed samples at `rate_Hz`, at least 2, not all zero; else NaN.
[[nodiscard]] double SpectralArcLength(std::span<const double> speed, double rate_Hz);

}  // namespace fulcrum::assessment
