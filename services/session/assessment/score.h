// Figures of a session and their points.
#pragma once

#include <array>
#include <vector>

#include "services/base/core/assessment.h"
#include "services/base/core/messages.h"

namespace fulcrum::assessment {

/// Values in the units of kMeasures; NaN: not known, or not applicable to this scene.
using MeasureValues = std::array<double, kMeasureCount>;

struct Figures {
  MeasureValues session;
  std::array<MeasureValues, kMaxTools> tool;
};

struct ScoreItem {
  Measure measure;
  double value;
  double limit;
  bool passed;
  double points;  ///< Points reached.
  double of;      ///< Points that can be reached; 0: measured, not scored.
};

/// All measures that apply to the scene, in the order of kMeasures, and the sum of their points.
struct Score {
  std::vector<ScoreItem> items;
  double points = 0, of = 0;
  [[nodiscard]] double percent() const { return of > 0 ? 100 * points / of : 0; }
};

/// Points of each measure. A kept threshold gives all points. Beyond it the points decrease in proportion, to none at
/// twice an upper threshold or half a lower one. In a scene with points for a task, the points for skill are scaled by
/// the completed share of the task, so that an idle trainee gets none.
[[nodiscard]] Score Evaluate(const AssessmentParams& params, const Figures& figures);

/// Share of the points for a value at a threshold, 0 … 1.
[[nodiscard]] double Kept(double value, double limit, bool at_least);

}  // namespace fulcrum::assessment
