#include "physics_node/accurate/accurate_solver.h"

#include <algorithm>
#include <cmath>

#include "physics_node/accurate/for_tasks.h"

namespace fulcrum::physics::accurate {
namespace {

/// The inertial guess goes no faster than this [m/s], or than the fastest tool by this factor: what a tool pulls comes
/// along, what snaps back or flaps beside a cut does not go on from one truncated solve's error to the next. Where
/// something would, the guess is also compared in energy with staying.
constexpr float kGuessedSpeed = 0.08f, kFasterThanTools = 1.5f;
/// Above this the solve is compared in energy with the guess [m].
constexpr float kDoubtfulCorrection = 0.0002f;
/// Nothing moves faster: ten times a quick hand [m/s].
constexpr float kLargestSpeed = 5.0f;
/// No place is so far from the origin [m].
constexpr float kFarthest = 10.0f;
/// Rows of the membrane that the coarse matrix takes over per step: complete about once in 30 steps. Twice as old, its
/// errors in the pull are two thirds larger.
constexpr int kRefreshRows = 10;

bool IsStiff(const Element& contact) { return contact.m.squaredNorm() > Elements::kStiffContact; }

}  // namespace

Effort EffortOf(PhysicsPreset preset) {
  switch (preset) {
    case PhysicsPreset::kFast:
      return {1, 3};
    case PhysicsPreset::kAccurate:
      return {4, 2};
    case PhysicsPreset::kReference:
      return {8, 2};
    case PhysicsPreset::kDefault:
      break;
  }
  return {2, 2};
}

AccurateSolver::AccurateSolver(const SceneView& scene, const ElasticModel& model, const TissueModel& tissue,
                               ParticleStore* particles, int threads, const Kernels& kernels)
    : kernels_(kernels),
      particles_(particles),
      tube_count_(particles->tube_count()),
      rows_(static_cast<int>(particles->layout().rows)),
      slots_(static_cast<int>(particles->layout().slots)),
      plane_(particles->layout().plane()),
      tube_floats_(particles->raw().size() - 4 * plane_),
      damping_(static_cast<float>(model.damping_per_s)),
      stiffening_(static_cast<float>(model.stiffening)),
      rest_scale_(1.0f / (1.0f + scene.physics.membrane_prestrain)),
      gravity_(model.gravity.cast<float>()),
      elements_(scene, model, *particles),
      coarse_(scene, model, *particles),
      workers_(threads),
      regions_(MakeRegions(model)) {
  PackSheet(model);
  PackOrgan(model, tube_count_);
  base_extra_ = FloatArray(plane_ + tube_count_ + 1);
  extra_ = FloatArray(plane_ + tube_count_ + 1);
  for (const auto& [base, stiffness] : elements_.Diagonal()) {
    base_extra_[base < tube_floats_ ? plane_ + base / 4 : base - tube_floats_] += stiffness;
  }
  std::copy_n(base_extra_.data(), base_extra_.size(), extra_.data());
  for (std::size_t d = 0; d < 3; ++d) {
    kt_[d] = FloatArray(plane_);
    along_[d] = FloatArray(plane_);
  }
  for (FloatArray& block : block_) {
    block = FloatArray(plane_);
  }
  for (FloatArray* a : {&organ_c_, &organ_f_, &organ_block_}) {
    *a = FloatArray(12 * (tube_count_ + std::size_t{1}));
  }
  organ_stress_ = FloatArray(16 * (tube_count_ + std::size_t{1}));
  const std::size_t pool = particles->raw().size();
  pressed_ = around_ = regions_.MakePart();
  for (FloatArray* a : {&velocity_, &place_, &residual_, &z_, &p_, &q_, &d_, &load_, &local_}) {
    *a = FloatArray(pool);
  }
  aside_ = FloatArray(pool);
  for (FloatArray& answer : answer_) {
    answer = FloatArray(pool);
  }
  for (Index p = 0; p < model.load.size(); ++p) {
    PutField(load_.data(), particles->Ref(p), model.load[p].cast<float>());
  }
  for (int worker = 0; worker < workers_.count(); ++worker) {
    carry_.emplace_back(kCarry * std::size_t{particles->layout().stride} + 16);
  }
  row_sums_ = FloatArray(static_cast<std::size_t>(rows_) * coarse_.row_width());
  const auto regions = static_cast<std::size_t>(regions_.count());
  for (auto* flags : {&held_before_, &touched_before_, &held_now_, &touched_now_, &pressed_now_}) {
    flags->assign(regions, 0);
  }
  stiffened_.assign(regions, 0);
  speed_.assign(regions, 0.0f);
  moved_.assign(particles->block_count(), 0.0f);
  moved_asleep_.assign(particles->block_count(), 0.0f);
  partial_.assign(regions, 0.0);
  guess_.assign(regions, {});
  finish_.assign(regions, {});
  const GridLayout& layout = particles->layout();
  for (std::uint32_t row = 0; row < layout.rows; ++row) {
    for (std::uint32_t col = 0; col < layout.cols; ++col) {
      for (std::size_t d = 0; d < 3; ++d) {
        FollowEdge(tissue, row, col, d);
      }
    }
  }
  elements_.Follow(tissue);
  FollowRegions();
  // The first coarse matrix: all of it, at rest.
  const Effort effort = EffortOf(scene.physics.preset);
  const Inertia inertia = MakeInertia(scene.physics.dt_s / static_cast<float>(effort.substeps));
  (void)Guess(inertia.h, 0.0f);
  Linearise(inertia, {});
  coarse_.Refresh(MakeSheet(), MakeMatrix(), inertia.inertia, rows_);
}

Sheet AccurateSolver::MakeSheet() const {
  return {rows_,
          slots_,
          {inverse_rest_[0].data(), inverse_rest_[1].data(), inverse_rest_[2].data()},
          {axial_[0].data(), axial_[1].data(), axial_[2].data()},
          stiffening_,
          particles_->plane(3),
          sheet_mass_.data()};
}

SheetMatrix AccurateSolver::MakeMatrix() {
  SheetMatrix matrix;
  for (std::size_t d = 0; d < 3; ++d) {
    matrix.kt[d] = kt_[d].data();
    matrix.along[d] = along_[d].data();
    matrix.place[d] = place_.data() + tube_floats_ + d * plane_;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    matrix.block[i] = block_[i].data();
  }
  return matrix;
}

Organ AccurateSolver::MakeOrgan() const {
  return {tube_count_,
          start_.data(),
          vertex_.data(),
          gradient_.data(),
          patch_start_.data(),
          patch_.data(),
          patch_gradient_.data(),
          volume_.data(),
          mu_,
          lambda_,
          static_cast<float>(kPatchVariance),
          organ_mass_.data()};
}

OrganMatrix AccurateSolver::MakeOrganMatrix() {
  return {organ_c_.data(), organ_f_.data(), organ_stress_.data(), organ_block_.data()};
}

Inertia AccurateSolver::MakeInertia(float h) const {
  return {h, (1.0f + damping_ * h) / (h * h), {gravity_.x(), gravity_.y(), gravity_.z()}};
}

SheetLinearise AccurateSolver::At(const FloatArray& place, FloatArray* residual) {
  SheetLinearise at;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t plane = tube_floats_ + axis * plane_;
    at.place[axis] = place.data() + plane;
    at.start[axis] = particles_->plane(static_cast<int>(axis));
    at.velocity[axis] = velocity_.data() + plane;
    at.load[axis] = load_.data() + plane;
    at.residual[axis] = residual ? residual->data() + plane : nullptr;
  }
  at.extra = extra_.data();
  return at;
}

OrganLinearisation AccurateSolver::OrganAt(const FloatArray& place) {
  return {place.data(), particles_->tube(), velocity_.data(), load_.data(), residual_.data()};
}

std::uint32_t AccurateSolver::BeginStep() {
  std::uint32_t resets = 0;
  if (!kernels_.within(particles_->tube(), kFarthest, 4 * std::size_t{tube_count_}, true) ||
      !kernels_.within(particles_->plane(0), kFarthest, 3 * plane_, false)) {
    resets = particles_->RepairPlaces(kFarthest);
    regions_.WakeAll();
  }
  moved_.swap(moved_asleep_);
  std::fill(moved_asleep_.begin(), moved_asleep_.end(), 0.0f);
  ForTasks([&](const Task& task, int, int) {
    Measure(task, &moved_);
    ForParts(task, [&](std::size_t first, std::size_t count) { particles_->RememberPlaces(first, count); });
  });
  organ_blocks_due_ = true;
  refresh_due_ = true;
  return resets;
}

void AccurateSolver::Measure(const Task& task, std::vector<float>* moved) const {
  if (task.sheet) {
    particles_->MeasureRows(Vertex(task.first), Vertex(task.end), moved->data());
  } else {
    particles_->MeasureTube(Vertex(task.first), Vertex(task.end), moved->data());
  }
}

/// What held particles and contacts begin, move or end wakes the tissue there.
void AccurateSolver::WakeTouched(std::span<const HeldPlace> held, std::span<const ContactRow> contacts) {
  std::fill(held_now_.begin(), held_now_.end(), std::uint8_t{0});
  std::fill(touched_now_.begin(), touched_now_.end(), std::uint8_t{0});
  for (const HeldPlace& h : held) {
    held_now_[static_cast<std::size_t>(regions_.Of(h.at))] = 1;
  }
  for (const ContactRow& row : contacts) {
    if (row.normal.dot(row.At(particles_->pool())) < row.offset) {
      const std::uint8_t how = row.drift.squaredNorm() > 0.0f ? 2 : 1;
      for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k) {
        std::uint8_t& touched = touched_now_[static_cast<std::size_t>(regions_.Of(row.at[k]))];
        touched = std::max(touched, how);
      }
    }
  }
  for (std::size_t i = 0; i < held_now_.size(); ++i) {
    const bool touch_changes = (touched_now_[i] != 0) != (touched_before_[i] != 0);
    if (held_now_[i] != 0 || held_before_[i] != 0 || touch_changes || touched_now_[i] == 2) {
      regions_.Wake(static_cast<int>(i));
    }
  }
  held_before_.swap(held_now_);
  touched_before_.swap(touched_now_);
}

/// Notes which regions stiff contacts press.
void AccurateSolver::FollowContacts() {
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

/// What is no longer computed does not move, and is no direction of the solve.
void AccurateSolver::FollowRegions() {
  elements_.FollowRegions(regions_);
  coarse_.FollowRegions(regions_);
  around_due_ = true;
  for (const int region : regions_.taken_out()) {
    Measure(regions_.Extent(region), &moved_asleep_);
    ForParts(regions_.Extent(region), [&](std::size_t first, std::size_t count) {
      particles_->RememberPlaces(first, count);
      for (FloatArray* field : {&velocity_, &z_, &p_, &q_, &d_}) {
        std::fill_n(field->data() + first, count, 0.0f);
      }
      for (FloatArray& answer : answer_) {
        std::fill_n(answer.data() + first, count, 0.0f);
      }
      std::copy_n(particles_->pool() + first, count, place_.data() + first);
    });
    const Task extent = regions_.Extent(region);
    for (int v = extent.first; !extent.sheet && v < extent.end; ++v) {
      place_[4 * static_cast<std::size_t>(v) + 3] = 0;  // A copy of the inverse mass.
    }
  }
}

/// Free particles go on with their velocity; what has no sound velocity stays.
GuessCount AccurateSolver::Guess(float h, float limit) {
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

float AccurateSolver::GuessLimit(float h, std::span<const HeldPlace> held, std::span<const ContactRow> contacts) const {
  float farthest_sq = 0;
  for (const HeldPlace& place : held) {
    farthest_sq = std::max(farthest_sq, (place.place - particles_->At(place.at)).squaredNorm());
  }
  for (const ContactRow& row : contacts) {
    farthest_sq = std::max(farthest_sq, row.drift.squaredNorm());
  }
  return std::max(kGuessedSpeed * h, kFasterThanTools * std::sqrt(farthest_sq));
}

void AccurateSolver::ForgetDamagedVelocities() {
  for (std::size_t i = 0; i < velocity_.size(); ++i) {
    velocity_[i] = std::isfinite(velocity_[i]) ? velocity_[i] : 0.0f;
  }
}

/// Where inertia does not tell where the guess is: held particles, along its normal what a tool presses, and what a cut
/// has frayed. Guessed from its velocity, that would bounce: the error of one solve, seen as velocity, doubles in the
/// next guess. Shreds that hang on little are light and turn far in a substep, and no few iterations solve them all.
void AccurateSolver::PutUnguessed(std::span<const HeldPlace> held, std::span<const ContactRow> contacts) {
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

double AccurateSolver::EnergyAt(const FloatArray& place, const Inertia& inertia, std::span<const ContactRow> contacts) {
  const Sheet sheet = MakeSheet();
  const Organ organ = MakeOrgan();
  const SheetLinearise at = At(place, nullptr);
  const OrganLinearisation organ_at = OrganAt(place);
  ForTasks([&](const Task& task, int index, int) {
    partial_[static_cast<std::size_t>(index)] =
        task.sheet ? kernels_.sheet_energy(sheet, inertia, at, task.first, task.end)
                   : kernels_.organ_energy(organ, inertia, organ_at, Vertex(task.first), Vertex(task.end));
  });
  return SumOfPartials(regions_.part().tasks.size()) + elements_.Energy(place.data(), contacts);
}

/// Contacts and folds stiffen the diagonal of what they touch.
void AccurateSolver::RefreshContactStiffness() {
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
  elements_.guard().ForDiagonal(
      [&](Index vertex, float stiffness) { stiffen(ParticleRef{4 * vertex}, stiffness, true); });
}

void AccurateSolver::Linearise(const Inertia& inertia, std::span<const ContactRow> contacts) {
  elements_.Touch(inertia.h, place_.data(), particles_->pool(), regions_, contacts);
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
  workers_.Run(static_cast<int>(sheet_tasks + patches.size()), regions_.part().sheet_tasks, [&](int index, int worker) {
    const auto i = static_cast<std::size_t>(index);
    const Task& task = i < sheet_tasks ? tasks[i] : patches[i - sheet_tasks];
    if (task.sheet) {
      kernels_.sheet_linearise(sheet, inertia, at, matrix, carry_[static_cast<std::size_t>(worker)].data(), task.first,
                               task.end);
    } else {
      kernels_.organ_linearise(organ, organ_matrix, place_.data(), Vertex(task.first), Vertex(task.end));
    }
  });
  // What touches the organ changes its blocks there; left alone it does not turn enough in a step to matter.
  const bool all_blocks = organ_blocks_due_;
  organ_blocks_due_ = false;
  ForTasks([&](const Task& task, int, int) {
    if (task.sheet) {
      const auto [first, end] = coarse_.MiddleRows(task.first, task.end);
      kernels_.middle_blocks(sheet, middle, matrix, inertia.inertia, first, end);
      return;
    }
    kernels_.organ_residual(organ, organ_matrix, inertia, OrganAt(place_), Vertex(task.first), Vertex(task.end));
    for (int first = task.first; first < task.end; first += Regions::kVertices) {
      std::uint8_t& stiffened = stiffened_[static_cast<std::size_t>(regions_.At(false, first))];
      if (all_blocks || stiffened != 0) {
        kernels_.organ_blocks(organ, organ_matrix, particles_->tube(), extra_.data() + plane_, inertia.inertia,
                              Vertex(first), Vertex(std::min(first + Regions::kVertices, task.end)));
      }
      stiffened = static_cast<std::uint8_t>(stiffened >> 1);
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
  elements_.Linearise(place_.data(), residual_.data());
}

/// Positions and velocities from place + d. What is not finite stays where it was, at rest.
SubstepReport AccurateSolver::Finish(float h) {
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
    const int size = task.sheet ? Regions::kRows : Regions::kVertices;
    for (int first = task.first; first < task.end; first += size) {
      const int end = std::min(first + size, task.end);
      const FinishCount part =
          task.sheet
              ? kernels_.sheet_finish(sheet, place.data(), d.data(), h, kLargestSpeed, x, velocity.data(), first, end)
              : kernels_.organ_finish(place_.data(), d_.data(), h, kLargestSpeed, particles_->pool(), velocity_.data(),
                                      Vertex(first), Vertex(end));
      speed_[static_cast<std::size_t>(regions_.At(task.sheet, first))] = std::sqrt(part.largest_speed_sq);
      total.largest_speed_sq = std::max(total.largest_speed_sq, part.largest_speed_sq);
      total.resets += part.resets;
    }
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

SubstepReport AccurateSolver::Substep(float h, int iterations, std::span<const HeldPlace> held,
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
  if (refresh_due_ && regions_.everything()) {
    coarse_.Refresh(MakeSheet(), MakeMatrix(), inertia.inertia, kRefreshRows);
    refresh_due_ = false;
  }
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

Vec3f AccurateSolver::ForceOn(ParticleRef at) const { return FieldAt(residual_.data(), at); }
Vec3f AccurateSolver::Velocity(ParticleRef at) const { return FieldAt(velocity_.data(), at); }
void AccurateSolver::SetVelocity(ParticleRef at, const Vec3f& v) {
  PutField(velocity_.data(), at, v);
  regions_.Wake(regions_.Of(at));
}
void AccurateSolver::Stop() { std::fill_n(velocity_.data(), velocity_.size(), 0.0f); }

}  // namespace fulcrum::physics::accurate
