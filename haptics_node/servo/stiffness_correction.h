// How much stiffer or softer the tissue is than the messages of physics say, learnt from the messages themselves: each
// brings the force at its own time, which the model of the message before had predicted. A Kalman filter in one
// unknown, ln s, where all stiffnesses and viscosities of the model are scaled by s. The force that a message starts
// from needs no scale, so its predicted change is proportional to s:
//
//     f(t2) - f_predicted(t2) = (s_true / s - 1) (f_predicted(t2) - f_ref(t1)) + noise
#pragma once

#include <algorithm>
#include <cmath>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

inline constexpr double kMaxStiffnessCorrection = 1.5;  ///< And its inverse: beyond, physics is not believed wrong.
inline constexpr double kPriorStiffnessError = 0.3;     ///< Standard deviation of ln s before anything is known.
inline constexpr double kStiffnessDrift = 0.02;         ///< Of ln s, per message: tissue stiffens as it is stretched.
inline constexpr double kReferenceNoise = 0.02;         ///< Of the reference force, relative to it.
inline constexpr double kReferenceNoise_N = 0.005;      ///< The same at no force.

class StiffnessCorrection {
 public:
  [[nodiscard]] double scale() const noexcept { return scale_; }

  /// What a message says against what the one before predicted for its time, along one direction.
  /// @param start reference force of the message before [N].
  /// @param predicted by it, for the time of the new message [N].
  /// @param reported reference force of the new message [N].
  void Learn(double start, double predicted, double reported) noexcept {
    // No force where one was predicted is a surface that was taken to be nearer than it is.
    if (!(std::abs(reported) > kReferenceNoise_N)) return;
    const double change = predicted - start;
    const double surprise = reported - predicted;
    const double noise = kReferenceNoise * std::abs(reported) + kReferenceNoise_N;
    const double spread = change * change * variance_ + noise * noise;
    // A surprise that no error of stiffness explains is a slip, a cut or a jump of physics.
    constexpr double kGate = 3.0;
    if (!(surprise * surprise <= kGate * kGate * spread)) return;
    const double gain = variance_ * change / spread;
    scale_ = std::clamp(scale_ * std::exp(gain * surprise), 1.0 / kMaxStiffnessCorrection, kMaxStiffnessCorrection);
    variance_ = std::min((1.0 - gain * change) * variance_ + kStiffnessDrift * kStiffnessDrift, kPrior);
  }
  /// Another contact: the scale stands until it is known better.
  void Doubt() noexcept { variance_ = kPrior; }

 private:
  static constexpr double kPrior = kPriorStiffnessError * kPriorStiffnessError;
  double scale_ = 1.0;
  double variance_ = kPrior;
};

}  // namespace fulcrum::haptics
