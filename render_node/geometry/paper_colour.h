// Colour of tissue by its present temperature as the paper prints it: eq. 15. For `thermal.as: printed`; membrane.frag
// computes the same with these numbers.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace fulcrum::render {

/// Thresholds of v, and the colours C1 to C3 (red, green, blue, alpha): above kVaporisation C1, above kBrown C2, else
/// C3.
struct PaperColour {
  float vaporisation = 0.988f, brown = 0.95f;
  Eigen::Vector4f c1{1, 1, 1, 0}, c2{1, 1, 1, 0}, c3{0.5f, 0.16f, 0.16f, 0.7f};
  float ambient_C = 37, vaporisation_C = 100;  ///< T_a and T_vaporization: not printed.

  /// v = min((T - T_a) / (T_vaporization - T_a), 1), and 0 below T_a, where the printed v is negative.
  [[nodiscard]] float Share(float celsius) const {
    return std::clamp((celsius - ambient_C) / (vaporisation_C - ambient_C), 0.0f, 1.0f);
  }
  /// C_mix = (1 - v) C_ori + v C.
  [[nodiscard]] Eigen::Vector4f Mix(const Eigen::Vector4f& original, float celsius) const {
    const float v = Share(celsius);
    const Eigen::Vector4f& c = v > vaporisation ? c1 : v > brown ? c2 : c3;
    return (1 - v) * original + v * c;
  }
};

}  // namespace fulcrum::render
