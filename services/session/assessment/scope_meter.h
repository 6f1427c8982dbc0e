// Measures of a held scope: horizon, the acting tool in the middle of the picture, and the path of the picture's middle
// over the membrane.
#pragma once

#include <cstddef>
#include <optional>

#include "services/base/core/lens.h"
#include "services/base/core/scope.h"
#include "services/session/assessment/line_meter.h"

namespace fulcrum::assessment {

/// Takes each ToolState in order; without a scope in the scene it measures nothing.
class ScopeMeter {
 public:
  explicit ScopeMeter(const SceneView& scene);

  /// True if the middle of the picture is farther from the planned line than the threshold of the largest deviation, in
  /// a scene whose line is traced by it.
  bool Add(double time_s, const ToolState& state);

  /// Mean over the time of the picture's rotation from level, without sign [rad].
  [[nodiscard]] std::optional<double> horizon_rad() const { return MeanOf(horizon_); }
  /// Mean over the time of the angle between the line of sight and the tip of the hook, or without one of the first
  /// other tool [rad].
  [[nodiscard]] std::optional<double> off_centre_rad() const { return MeanOf(off_centre_); }
  /// Time for which the lens was smeared by tissue that it had touched [s]; no value without a scope.
  [[nodiscard]] std::optional<double> smeared_s() const { return scope_ ? std::optional(smeared_s_) : std::nullopt; }
  /// Trace of the middle of the picture on the membrane at rest.
  [[nodiscard]] const LineMeter& line() const { return line_; }

 private:
  struct Sum {
    double value = 0, time_s = 0;
  };
  static std::optional<double> MeanOf(const Sum& sum);
  [[nodiscard]] HookSample MiddleOf(double time_s, const Vec3f& eye, const Vec3f& forward) const;

  SceneView scene_;
  std::vector<std::uint8_t> of_line_;          ///< By node of the grid: it belongs to the sheet of the line.
  std::optional<std::size_t> scope_, acting_;  ///< Tools.
  LineMeter line_;
  Lens lens_;
  double last_s_ = -1;
  Sum horizon_, off_centre_;
  double smeared_s_ = 0;
};

}  // namespace fulcrum::assessment
