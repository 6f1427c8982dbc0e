// Online estimate of the ratio s of the tissue's stiffness to that in the contact models of physics. Each model brings
// the force at its own time, which the previous model has predicted; the difference is the innovation of a Kalman
// filter with the one unknown ln s. All stiffnesses and viscosities of a model are scaled by s. The reference force of
// a message is not scaled, so the predicted change of force is proportional to s:
//
//     f(t2) - f_predicted(t2) = (s_true / s - 1) (f_predicted(t2) - f_ref(t1)) + noise
#pragma once

#include <algorithm>
#include <cmath>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

/// Upper limit of s; its inverse is the lower limit. Larger errors of physics are not assumed.
inline constexpr double kMaxStiffnessCorrection = 1.5;
inline constexpr double kPriorStiffnessError = 0.3;  ///< Prior standard deviation of ln s.
/// Process noise of ln s per message: tissue stiffens as it is stretched.
inline constexpr double kStiffnessDrift = 0.02;
inline constexpr double kReferenceNoise = 0.02;     ///< Measurement noise relative to the reference force.
inline constexpr double kReferenceNoise_N = 0.005;  ///< Measurement noise at zero force.

class StiffnessCorrection {
 public:
  [[nodiscard]] double scale() const noexcept { return scale_; }

  /// Updates the estimate with the reported and the predicted force of a message, along one direction.
  /// @param start reference force of the previous message [N].
  /// @param predicted force predicted by the previous message for the time of the new one [N].
  /// @param reported reference force of the new message [N].
  void Learn(double start, double predicted, double reported) noexcept {
    // A predicted force without a reported one is an error of the surface's position, not of its stiffness.
    if (!(std::abs(reported) > kReferenceNoise_N)) return;
    const double change = predicted - start;
    const double innovation = reported - predicted;
    const double noise = kReferenceNoise * std::abs(reported) + kReferenceNoise_N;
    const double innovation_variance = change * change * variance_ + noise * noise;
    // An innovation beyond three standard deviations is a slip, a cut or a jump of physics, not an error of stiffness.
    constexpr double kGate = 3.0;
    if (!(innovation * innovation <= kGate * kGate * innovation_variance)) return;
    const double gain = variance_ * change / innovation_variance;
    scale_ = std::clamp(scale_ * std::exp(gain * innovation), 1.0 / kMaxStiffnessCorrection, kMaxStiffnessCorrection);
    variance_ = std::min((1.0 - gain * change) * variance_ + kStiffnessDrift * kStiffnessDrift, kPrior);
  }
  /// Resets the variance for a new contact; the scale is kept as the initial estimate.
  void ResetVariance() noexcept { variance_ = kPrior; }

 private:
  static constexpr double kPrior = kPriorStiffnessError * kPriorStiffnessError;
  double scale_ = 1.0;
  double variance_ = kPrior;
};

}  // namespace fulcrum::haptics
