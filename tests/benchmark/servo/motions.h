// The five motions for the comparison of force strategies, and the loop that runs them.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/core/tick.h"
#include "services/base/core/types.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {

struct Motion {
  const char* name;
  double cycle_s;  ///< Period of the motion.
  std::function<Vec3d(double)> tip;
  testing::TissueParameters tissue;
};
/// press, palpate, tap, slide, grasp. Press and tap begin and end contacts; the others last.
[[nodiscard]] std::vector<Motion> Motions();

/// A method to compute the force of each millisecond from the delayed reports of physics.
class ForceStrategy {
 public:
  virtual ~ForceStrategy() = default;
  /// Receives a report, before Step() of its tick.
  virtual void Offer(const ContactModel& model, const Tick& tick) = 0;
  /// Force of the tissue on the tool with its tip at `tip` [N]. `proxy`: position at which the tissue is touched, set
  /// to `tip` unless the strategy has a coupling of its own.
  [[nodiscard]] virtual Vec3d Step(const Tick& tick, const Vec3d& tip, Vec3d* proxy) = 0;
};

/// Ratios of the parameters that physics assumes to the true ones.
struct Mismatch {
  double stiffness = 1;  ///< k1, k3, kt, Kb.
  double viscosity = 1;  ///< Bb.
};

struct Physics {
  double period_s = 0.010;   ///< Between two reports.
  double latency_s = 0.010;  ///< From the tool sample that it used to the report's arrival.
  Mismatch mismatch;
  double noise = 0;  ///< Standard deviation of the reference force, relative to it.
};

struct ForceError {
  double percent = 0;        ///< RMS over RMS force.
  double first_percent = 0;  ///< The same over the first cycle after the start.
  double excess_step_N = 0;  ///< Largest change of the error from one tick to the next.
};
/// Follows a motion for some cycles against tissue integrated at 20 us. The first cycle begins when forces are up, from
/// rest.
[[nodiscard]] ForceError Follow(const Motion& motion, const Physics& physics, ForceStrategy* strategy);

}  // namespace fulcrum::haptics
