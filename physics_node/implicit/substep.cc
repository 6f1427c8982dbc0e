// One substep: a guess from inertia, its linearisation, the solve and where that puts the particles.
#include <algorithm>
#include <cmath>

#include "physics_node/implicit/for_tasks.h"
#include "physics_node/implicit/implicit_solver.h"

namespace fulcrum::physics::implicit {
namespace {

/// The inertial guess goes no faster than this [m/s], or than the fastest tool by this factor: what a tool pulls comes
/// along, what snaps back or flaps beside a cut does not go on from one truncated solve's error to the next. Where
/// something would, the guess is also compared in energy with staying.
constexpr float kGuessedSpeed = 0.08f, kFasterThanTools = 1.5f;
/// Above this the solve is compared in energy with the guess [m].
constexpr float kDoubtfulCorrection = 0.0002f;
/// Nothing moves faster: ten times a quick hand [m/s].
constexpr float kLargestSpeed = 5.0f;

bool IsStiff(const Element& contact) { return contact.m.squaredNorm() > Elements::kStiffContact; }

}  // namespace

/// Free particles go on with their velocity; what has no sound velocity stays.
GuessCount ImplicitSolver::Guess(float h, float limit) {
  const Sheet sheet = MakeSheet();
  const SheetLinearise at = At(place_, nullptr);
  float* const place[3] = {place_.data() + tube_floats_, place_.data() + tube_floats_ + plane_,
                           place_.data() + tube_floats_ + 2 * plane_};
  ForTasks([&](const Task& task, int index, int) {
    guess_[static_cast<std::size_t>(index)] =
        task.sheet ? kernels_.sheet_guess(sheet, h, limit, at.start, at.velocity, place, task.first, task.end)
                   : kernels_.organ_guess(h, limit, particles_->tube(), velocity_.data(), place_.data(),
                                          Vertex(task.first), Vertex(task.end));
  });
  GuessCount count{};
  for (std::size_t i = 0; i < regions_.part().tasks.size(); ++i) {
    count.largest_sq = std::max(count.largest_sq, guess_[i].largest_sq);
    count.resets += guess_[i].resets;
  }
  return count;
}

float ImplicitSolver::GuessLimit(float h, std::span<const HeldPlace> held, std::span<const ContactRow> contacts) const {
  float farthest_sq = 0;
  for (const HeldPlace& place : held) {
    farthest_sq = std::max(farthest_sq, (place.place - particles_->At(place.at)).squaredNorm());
  }
  for (const ContactRow& row : contacts) {
    farthest_sq = std::max(farthest_sq, row.drift.squaredNorm());
  }
  return std::max(kGuessedSpeed * h, kFasterThanTools * std::sqrt(farthest_sq));
}

void ImplicitSolver::ForgetDamagedVelocities() {
  for (std::size_t i = 0; i < velocity_.size(); ++i) {
    velocity_[i] = std::isfinite(velocity_[i]) ? velocity_[i] : 0.0f;
  }
}

/// Where inertia does not tell where the guess is: held particles, along its normal what a tool presses, and what a cut
/// has frayed. Guessed from its velocity, that would bounce: the error of one solve, seen as velocity, doubles in the
/// next guess. Shreds that hang on little are light and turn far in a substep, and no few iterations solve them all.
void ImplicitSolver::PutUnguessed(std::span<const HeldPlace> held, std::span<const ContactRow> contacts) {
  for (const ParticleRef at : frayed_) {
    PutField(place_.data(), at, particles_->At(at));
  }
  for (const ContactRow& row : contacts) {
    if (!(Elements::ContactStiffness(row) > Elements::kStiffContact)) {
      continue;
    }
    const float inside = row.offset - row.normal.dot(row.At(particles_->pool()));
    if (!(inside > 0.0f)) {
      continue;
    }
    // With the tool, but no farther than to its surface.
    const float along = std::min(row.normal.dot(row.drift), inside);
    for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k) {
      const Vec3f place = FieldAt(place_.data(), row.at[k]), moved = place - particles_->At(row.at[k]);
      if (particles_->InverseMass(row.at[k]) > 0.0f) {
        PutField(place_.data(), row.at[k], place + row.normal * (along - row.normal.dot(moved)));
      }
    }
  }
  for (const HeldPlace& h : held) {
    PutField(place_.data(), h.at, h.place);
  }
}

double ImplicitSolver::EnergyAt(const FloatArray& place, const Inertia& inertia, std::span<const ContactRow> contacts) {
  const Sheet sheet = MakeSheet();
  const Organ organ = MakeOrgan();
  const SheetLinearise at = At(place, nullptr);
  const OrganLinearisation organ_at = OrganAt(place);
  const std::span<const Task> tasks = regions_.part().tasks;
  const int sheet_tasks = regions_.part().sheet_tasks;
  double of_hinges = 0, of_others = 0;
  ForTasksBeside(
      sheet_tasks, static_cast<int>(tasks.size()) - sheet_tasks,
      [&](int index, int) {
        const auto i = static_cast<std::size_t>(index);
        const Task& task = tasks[i];
        partial_[i] = task.sheet
                          ? kernels_.sheet_energy(sheet, inertia, at, task.first, task.end)
                          : kernels_.organ_energy(organ, inertia, organ_at, Vertex(task.first), Vertex(task.end));
      },
      [&] { of_hinges = elements_.EnergyOfHinges(place.data()); },
      [&] { of_others = elements_.EnergyOfOthers(place.data(), contacts); });
  return SumOfPartials(tasks.size()) + (of_hinges + of_others);
}

/// Contacts and folds stiffen the diagonal of what they touch.
void ImplicitSolver::RefreshContactStiffness() {
  const auto slot = [&](ParticleRef at) {
    return static_cast<std::uint32_t>(at.base < tube_floats_ ? plane_ + at.base / 4 : at.base - tube_floats_);
  };
  for (const std::uint32_t i : extra_changed_) {
    extra_[i] = base_extra_[i];
  }
  extra_changed_.clear();
  // Blocks of the organ that only soft contacts touch wait for the next step. Once more after the last time, to be as
  // without.
  const auto stiffen = [&](ParticleRef at, float stiffness, bool at_once) {
    extra_[slot(at)] += stiffness;
    extra_changed_.push_back(slot(at));
    if (at_once) {
      stiffened_[static_cast<std::size_t>(regions_.Of(at))] = 2;
    }
  };
  for (const Element& contact : elements_.touching()) {
    const float stiffness = contact.kt + contact.m.squaredNorm();
    for (int k = 0; k < contact.count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      stiffen(contact.at[i], stiffness * contact.weight[i] * contact.weight[i], IsStiff(contact));
    }
  }
  for (const FrayedEdge& edge : frayed_edges_) {
    for (const std::uint32_t i : edge.at) {
      extra_[i] += edge.stiffness;
      extra_changed_.push_back(i);
    }
  }
  elements_.guard().ForDiagonal(
      [&](Index vertex, float stiffness) { stiffen(ParticleRef{4 * vertex}, stiffness, true); });
}

/// What hangs on little turns freely: nothing but its small mass then resists a correction across its edges.
void ImplicitSolver::HoldFrayed() {
  for (const FrayedEdge& edge : frayed_edges_) {
    float& kt = kt_[edge.direction][edge.at[0]];
    kt = std::max(kt, edge.stiffness);
  }
}

/// Notes which regions stiff contacts press.
void ImplicitSolver::FollowContacts() {
  stiff_contacts_ = false;
  std::fill(pressed_now_.begin(), pressed_now_.end(), std::uint8_t{0});
  for (const Element& contact : elements_.touching()) {
    for (std::size_t k = 0; IsStiff(contact) && k < static_cast<std::size_t>(contact.count); ++k) {
      const int region = regions_.Of(contact.at[k]);
      pressed_now_[static_cast<std::size_t>(region)] = regions_.computed(region) ? 1 : 0;
      stiff_contacts_ = true;
    }
  }
  if (!stiff_contacts_ || (!around_due_ && pressed_now_ == pressed_.marked)) {
    return;
  }
  around_due_ = false;
  for (const Task& task : pressed_.tasks) {
    ForParts(task, [&](std::size_t first, std::size_t count) { std::fill_n(local_.data() + first, count, 0.0f); });
  }
  pressed_.marked = pressed_now_;
  regions_.FindTasks(&pressed_);
  around_.marked = pressed_now_;
  regions_.Widen(&around_);
  regions_.FindTasks(&around_);
  elements_.Select(regions_, pressed_.marked, around_.marked, &around_elements_);
}

void ImplicitSolver::Linearise(const Inertia& inertia, std::span<const ContactRow> contacts) {
  workers_.Run(2, 0, [&](int task, int) {
    if (task == 0) {
      elements_.Touch(inertia.h, place_.data(), particles_->pool(), regions_, contacts);
    } else {
      elements_.LookForFolds(place_.data());
    }
  });
  RefreshContactStiffness();
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const SheetLinearise at = At(place_, &residual_);
  const Organ organ = MakeOrgan();
  const OrganMatrix organ_matrix = MakeOrganMatrix();
  const Middle middle = coarse_.middle();
  // Stresses reach the vertices around, edges the row below: two phases.
  const std::span<const Task> tasks = regions_.part().tasks, patches = regions_.part().patches;
  const auto sheet_tasks = static_cast<std::size_t>(regions_.part().sheet_tasks);
  ForTasksBeside(
      regions_.part().sheet_tasks, static_cast<int>(patches.size()),
      [&](int index, int worker) {
        const auto i = static_cast<std::size_t>(index);
        const Task& task = i < sheet_tasks ? tasks[i] : patches[i - sheet_tasks];
        if (task.sheet) {
          kernels_.sheet_linearise(sheet, inertia, at, matrix, carry_[static_cast<std::size_t>(worker)].data(),
                                   task.first, task.end);
        } else {
          kernels_.organ_linearise(organ, organ_matrix, place_.data(), Vertex(task.first), Vertex(task.end));
        }
      },
      [&] { elements_.LineariseHinges(place_.data()); }, [&] { elements_.LineariseOthers(place_.data()); });
  HoldFrayed();
  // What touches the organ changes its blocks there; left alone it does not turn enough in two steps to matter.
  const bool all_blocks = inertia.inertia != blocks_inertia_, half_of_blocks = organ_blocks_due_;
  blocks_inertia_ = inertia.inertia;
  organ_blocks_due_ = false;
  const auto second = [&](const Task& task, int, int) {
    if (task.sheet) {
      const auto [first, end] = coarse_.MiddleRows(task.first, task.end);
      kernels_.middle_blocks(sheet, middle, matrix, inertia.inertia, first, end);
      return;
    }
    kernels_.organ_residual(organ, organ_matrix, inertia, OrganAt(place_), Vertex(task.first), Vertex(task.end));
    for (int first = task.first; first < task.end; first += Regions::kVertices) {
      const int region = regions_.At(false, first);
      std::uint8_t& stiffened = stiffened_[static_cast<std::size_t>(region)];
      const bool due = half_of_blocks && (static_cast<std::uint32_t>(region) + steps_) % 2 == 0;
      if (all_blocks || due || stiffened != 0) {
        kernels_.organ_blocks(organ, organ_matrix, particles_->tube(), extra_.data() + plane_, inertia.inertia,
                              Vertex(first), Vertex(std::min(first + Regions::kVertices, task.end)));
      }
      stiffened = static_cast<std::uint8_t>(stiffened >> 1);
    }
  };
  ForTasks(second, [&] {
    if (refresh_due_ && regions_.everything()) {
      coarse_.Refresh(sheet, matrix, inertia.inertia);
      refresh_due_ = false;
    }
  });
  coarse_.LeaveOrganAlone(elements_.guard().folded());
  coarse_.ForgetContacts();
  for (const Element& contact : elements_.touching()) {
    if (IsStiff(contact)) {
      coarse_.Stiffen(contact);
    }
  }
  coarse_.FadeAtContacts();
  FollowContacts();
  elements_.AddContactForces(residual_.data());
  forces_due_ = true;
}

/// Positions and velocities from place + d. What is not finite stays where it was, at rest.
SubstepReport ImplicitSolver::Finish(float h) {
  const auto planes = [&](FloatArray& field) {
    float* at = field.data() + tube_floats_;
    return std::array<float*, 3>{at, at + plane_, at + 2 * plane_};
  };
  const Sheet sheet = MakeSheet();
  const std::array<float*, 3> place = planes(place_), d = planes(d_), velocity = planes(velocity_);
  float* const x[3] = {particles_->plane(0), particles_->plane(1), particles_->plane(2)};
  std::fill(speed_.begin(), speed_.end(), 0.0f);
  ForTasks([&](const Task& task, int index, int) {
    FinishCount& total = finish_[static_cast<std::size_t>(index)] = {};
    ForRegions(task, [&](int region, int first, int end) {
      const FinishCount part =
          task.sheet
              ? kernels_.sheet_finish(sheet, place.data(), d.data(), h, kLargestSpeed, x, velocity.data(), first, end)
              : kernels_.organ_finish(place_.data(), d_.data(), h, kLargestSpeed, particles_->pool(), velocity_.data(),
                                      Vertex(first), Vertex(end));
      speed_[static_cast<std::size_t>(region)] = std::sqrt(part.largest_speed_sq);
      total.largest_speed_sq = std::max(total.largest_speed_sq, part.largest_speed_sq);
      total.resets += part.resets;
    });
  });
  SubstepReport report;
  float largest = 0;
  for (std::size_t i = 0; i < regions_.part().tasks.size(); ++i) {
    largest = std::max(largest, finish_[i].largest_speed_sq);
    report.resets += finish_[i].resets;
  }
  report.largest_speed_m_s = std::sqrt(largest);
  return report;
}

SubstepReport ImplicitSolver::Substep(float h, int iterations, std::span<const HeldPlace> held,
                                      std::span<ContactRow> contacts) {
  const Inertia inertia = MakeInertia(h);
  WakeTouched(held, contacts);
  if (regions_.Rebuild()) {
    FollowRegions();
  }
  const float limit = GuessLimit(h, held, contacts);
  const GuessCount guess = Guess(h, limit);
  if (guess.resets > 0) {
    ForgetDamagedVelocities();
  }
  PutUnguessed(held, contacts);
  if (guess.largest_sq > limit * limit) {
    const double moving = EnergyAt(place_, inertia, contacts);
    (void)Guess(0.0f, 0.0f);
    PutUnguessed(held, contacts);
    if (moving < EnergyAt(place_, inertia, contacts)) {
      (void)Guess(h, limit);
      PutUnguessed(held, contacts);
    }
  }
  Linearise(inertia, contacts);
  for (std::size_t i = 0; i < wanted_now_.size(); ++i) {
    wanted_now_[i] = pressed_now_[i] != 0 || (held_before_[i] != 0 && regions_.computed(static_cast<int>(i))) ? 1 : 0;
  }
  WantResidual(wanted_now_);
  Solve(inertia.inertia, iterations);
  if (stiff_contacts_) {
    SolveAtContacts(inertia.inertia);
  }
  const float largest = LargestCorrection();
  LimitCorrection(largest);
  if (largest > kDoubtfulCorrection) {
    SearchAlongCorrection(inertia, contacts);
  }
  // Before the particles move on: their start is still in the store.
  Elements::WriteForces(h, place_.data(), d_.data(), particles_->pool(), contacts);
  SubstepReport report = Finish(h);
  regions_.Settle(speed_, h);
  report.largest_correction_m = largest;
  report.searched = largest > kDoubtfulCorrection;
  report.resets += guess.resets;
  return report;
}

}  // namespace fulcrum::physics::implicit
