#include "services/session/assessment/score.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::assessment {

double Kept(double value, double limit, bool at_least) {
  if (std::isnan(value)) return 0;
  if (at_least ? value >= limit : value <= limit) return 1;
  // For a lower threshold below 0, twice the threshold gives no points.
  if (at_least)
    return limit > 0 ? std::clamp(2 * value / limit - 1, 0.0, 1.0) : std::clamp(2 - value / limit, 0.0, 1.0);
  return limit > 0 ? std::clamp(2 - value / limit, 0.0, 1.0) : 0;
}

Score Evaluate(const AssessmentParams& params, const Figures& figures) {
  Score score;
  double done = 0, task = 0;
  for (std::size_t i = 0; i < kMeasureCount; ++i) {
    const MeasureInfo& info = kMeasures[i];
    const double value = figures.session[i], limit = static_cast<double>(params.limit[i]);
    if (std::isnan(value)) continue;
    const double kept = Kept(value, limit, info.at_least), of = static_cast<double>(params.points[i]);
    score.items.push_back({static_cast<Measure>(i), value, limit, kept == 1, kept * of, of});
    score.of += of;
    if (info.role == MeasureRole::kTask) {
      done += kept * of;
      task += of;
    }
  }
  const double share = task > 0 ? done / task : 1;
  for (ScoreItem& item : score.items) {
    if (InfoOf(item.measure).role == MeasureRole::kSkill) item.points *= share;
    score.points += item.points;
  }
  return score;
}

}  // namespace fulcrum::assessment
