// Figures of a session and what they are worth.
#pragma once

#include <array>
#include <vector>

#include "services/base/core/assessment.h"
#include "services/base/core/messages.h"

namespace fulcrum::assessment {

/// In the units of kMeasures; NaN: not known, or of no meaning in this scene.
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
  double points;  ///< Given …
  double of;      ///< … of so many; 0: measured, not scored.
};

/// All measures that mean something in the scene, in the order of kMeasures, and their sum.
struct Score {
  std::vector<ScoreItem> items;
  double points = 0, of = 0;
  [[nodiscard]] double percent() const { return of > 0 ? 100 * points / of : 0; }
};

/// A threshold that is kept gives all points, else fewer in proportion, none from twice the threshold on (half of it
/// where at least so much is wanted). The points for skill count in proportion to what was done of the task, if the
/// scene gives points for a task: whoever does nothing is given nothing.
[[nodiscard]] Score Evaluate(const AssessmentParams& params, const Figures& figures);

/// How far a value keeps a threshold, 0 … 1.
[[nodiscard]] double Kept(double value, double limit, bool at_least);

}  // namespace fulcrum::assessment
