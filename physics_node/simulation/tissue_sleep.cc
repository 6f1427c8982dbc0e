// Sleep of the whole tissue: conditions for falling asleep and for waking.
#include <algorithm>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {
namespace {

/// Movement in a step below which tissue is still [m], 0.1 mm/s at 100 Hz, and the number of such steps until it
/// sleeps.
constexpr float kStill = 1e-6f;
constexpr int kStillSteps = 50;
/// Movement below which fewer steps suffice [m]: tissue at rest moves only by rounding.
constexpr float kAtRest = 1e-7f;
constexpr int kRestSteps = 10;

}  // namespace

bool TissueSimulation::ToolsMove() const {
  return std::any_of(tracks_.begin(), tracks_.end(),
                     [](const ToolTrack& track) { return track.present && track.moved(); });
}

/// For sleeping tissue: a breathing surface has come near it.
bool TissueSimulation::BreathingReachesTissue() {
  if (!(scene_.breathing.amplitude_m > 0.0f) || scene_.physics.mode == PhysicsMode::kPaper) {
    return false;
  }
  moved_.assign(particles_.block_count(), 0.0f);
  FindTissueContacts();
  return tissue_collision_.breath_near();
}

/// For sleeping tissue: a tool touches it in this step. In mode accurate it must violate a contact row, so that a jaw
/// that closes around tissue, or a tip that hovers over it, does not wake it; in the other modes a tool near it
/// suffices.
bool TissueSimulation::ToolsTouchTissue() {
  if (!implicit_) {
    return !collision_.pairs().empty();
  }
  collision_.Rows(0.0f, 1.0f, &rows_);
  return std::any_of(rows_.begin(), rows_.end(), [this](const ContactRow& row) {
    return !(row.normal.dot(row.At(particles_.raw().data())) >= row.offset);
  });
}

/// Wakes the tissue if a tool or a breathing surface reaches it. True: it stays asleep.
bool TissueSimulation::StaysAsleep() {
  if (!sleep_.asleep) {
    return false;
  }
  if (ToolsMove()) {
    const bool touched = collision_.any_touching();
    FindContacts(false);
    sleep_.asleep = !touched && !ToolsTouchTissue();
  }
  sleep_.asleep = sleep_.asleep && !BreathingReachesTissue();
  return sleep_.asleep;
}

/// After a step: the tissue falls asleep after kStillSteps still steps without grasp or moving contact.
void TissueSimulation::UpdateSleep(const StepReport& report, bool holds) {
  const bool worked_on = ToolsMove() && (implicit_ ? collision_.any_touching() : !collision_.pairs().empty());
  sleep_.still_steps = report.max_step_m < kStill && !holds && !worked_on && !tissue_collision_.breath_near()
                           ? sleep_.still_steps + (report.max_step_m < kAtRest ? kStillSteps / kRestSteps : 1)
                           : 0;
  if (sleep_.still_steps >= kStillSteps) {
    solver_.Stop();
    if (implicit_) {
      implicit_->Stop();
    }
    if (xpbd_) {
      xpbd_->Stop();
    }
    collision_.FitAtRest();
    sleep_.asleep = true;
    sleep_.still_steps = 0;
  }
}

}  // namespace fulcrum::physics
