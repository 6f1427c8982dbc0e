// When all of the tissue falls asleep, and what wakes it.
#include <algorithm>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {
namespace {

/// Tissue that moves less than this per step (0.1 mm/s at 100 Hz), for so many steps, is at rest.
constexpr float kStill = 1e-6f;
constexpr int kStillSteps = 50;
/// And so is what moves less than this, for fewer steps: tissue at rest moves by rounding alone [m].
constexpr float kAtRest = 1e-7f;
constexpr int kRestSteps = 10;

}  // namespace

bool TissueSimulation::ToolsMove() const {
  return std::any_of(tracks_.begin(), tracks_.end(),
                     [](const ToolTrack& track) { return track.present && track.moved(); });
}

/// Asleep: what breathes has come near the tissue.
bool TissueSimulation::BreathStirs() {
  if (!(scene_.breathing.amplitude_m > 0.0f) || scene_.physics.mode == PhysicsMode::kPaper) {
    return false;
  }
  moved_.assign(particles_.block_count(), 0.0f);
  FindTissueContacts();
  return tissue_collision_.breath_near();
}

/// Asleep: a tool comes to touch the tissue in this step. Where contacts are rows, one that is merely near does not: a
/// jaw that closes around tissue, a tip that hovers over it.
bool TissueSimulation::ToolsStir() {
  if (!implicit_) {
    return !collision_.pairs().empty();
  }
  collision_.Rows(0.0f, 1.0f, &rows_);
  return std::any_of(rows_.begin(), rows_.end(), [this](const ContactRow& row) {
    return !(row.normal.dot(row.At(particles_.raw().data())) >= row.offset);
  });
}

/// True while the tissue sleeps and nothing stirs it.
bool TissueSimulation::MayRest() {
  if (!asleep_) {
    return false;
  }
  if (ToolsMove()) {
    const bool touched = collision_.any_touching();
    FindContacts(false);
    asleep_ = !touched && !ToolsStir();
  }
  asleep_ = asleep_ && !BreathStirs();
  return asleep_;
}

/// After a step: nothing has moved for a while, and nothing works on it.
void TissueSimulation::MayFallAsleep(const StepReport& report, bool holds) {
  const bool worked_on = ToolsMove() && (implicit_ ? collision_.any_touching() : !collision_.pairs().empty());
  still_steps_ = report.max_step_m < kStill && !holds && !worked_on && !tissue_collision_.breath_near()
                     ? still_steps_ + (report.max_step_m < kAtRest ? kStillSteps / kRestSteps : 1)
                     : 0;
  if (still_steps_ >= kStillSteps) {
    solver_.Stop();
    if (implicit_) {
      implicit_->Stop();
    }
    if (xpbd_) {
      xpbd_->Stop();
    }
    collision_.FitAtRest();
    asleep_ = true;
    still_steps_ = 0;
  }
}

}  // namespace fulcrum::physics
