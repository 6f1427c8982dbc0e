// How fast the tissue's time passes.
#pragma once

#include <algorithm>

namespace fulcrum {

/// Simulated over passed time, of the last two seconds or so: below 1 where a machine is too slow for a scene. Single
/// intervals may be too short and too long by turns.
class Pace {
 public:
  void Add(double simulated_s, double passed_s) {
    if (!(passed_s > 0) || !(simulated_s >= 0)) return;
    const double keep = std::max(1 - passed_s / kWindow_s, 0.0);
    simulated_s_ = keep * simulated_s_ + simulated_s;
    passed_s_ = keep * passed_s_ + passed_s;
  }
  [[nodiscard]] double value() const { return std::min(simulated_s_ / passed_s_, 1.0); }
  /// A value below which the tissue is called slow.
  static constexpr double kSlow = 0.97;

 private:
  static constexpr double kWindow_s = 2;
  double simulated_s_ = kWindow_s, passed_s_ = kWindow_s;
};

}  // namespace fulcrum
