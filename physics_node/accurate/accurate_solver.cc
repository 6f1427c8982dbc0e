#include "physics_node/accurate/accurate_solver.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace fulcrum::physics::accurate {
namespace {

/// Above this the inertial guess is compared with the state before it, and the solve with the guess [m].
constexpr float kDoubtfulGuess = 0.0005f;
constexpr float kDoubtfulCorrection = 0.0002f;
/// No particle is corrected by more in one solve [m].
constexpr float kLargestCorrection = 0.003f;
constexpr int kHalvings = 4;
/// Nothing moves faster: ten times a quick hand [m/s].
constexpr float kLargestSpeed = 5.0f;
/// No place is so far from the origin [m].
constexpr float kFarthest = 10.0f;
/// Rows of the membrane that the coarse matrix takes over per step: complete about once in 60 steps.
constexpr int kRefreshRows = 5;

/// Planes of a field's membrane part.
struct Planes {
  float* p[3];
  operator float* const*() { return p; }
};

Vec3f Read(const float* field, ParticleRef r) {
  const std::size_t s = r.step;
  return {field[r.base], field[r.base + s], field[r.base + 2 * s]};
}
void Write(float* field, ParticleRef r, const Vec3f& v) {
  const std::size_t s = r.step;
  field[r.base] = v.x();
  field[r.base + s] = v.y();
  field[r.base + 2 * s] = v.z();
}

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
                               ParticleStore* particles, const Kernels& kernels)
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
      coarse_(scene, model, *particles) {
  PackSheet(model);
  PackOrgan(model, tube_count_);
  base_extra_ = FloatArray(plane_ + tube_count_ + 1);
  extra_ = FloatArray(plane_ + tube_count_ + 1);
  for (const auto& [base, stiffness] : elements_.Diagonal()) {
    base_extra_[base < tube_floats_ ? plane_ + base / 4 : base - tube_floats_] += stiffness;
  }
  std::copy_n(base_extra_.data(), base_extra_.size(), extra_.data());
  for (int d = 0; d < 3; ++d) {
    const auto i = static_cast<std::size_t>(d);
    kt_[i] = FloatArray(plane_);
    for (FloatArray& axis : m_[i]) {
      axis = FloatArray(plane_);
    }
  }
  for (FloatArray& block : block_) {
    block = FloatArray(plane_);
  }
  for (FloatArray* a : {&organ_c_, &organ_f_, &organ_stress_, &organ_block_}) {
    *a = FloatArray(12 * (tube_count_ + std::size_t{1}));
  }
  const std::size_t pool = particles->raw().size();
  for (FloatArray* a : {&velocity_, &place_, &residual_, &z_, &p_, &q_, &d_, &load_}) {
    *a = FloatArray(pool);
  }
  for (Index p = 0; p < model.load.size(); ++p) {
    Write(load_.data(), particles->Ref(p), model.load[p].cast<float>());
  }
  carry_ = FloatArray(kCarry * std::size_t{particles->layout().stride} + 16);
  row_sums_ = FloatArray(static_cast<std::size_t>(rows_) * coarse_.row_width());
  partial_.assign(static_cast<std::size_t>(rows_) / kChunkRows + 1, 0.0);
  Follow(tissue);
  // The first coarse matrix: all of it, at rest.
  const Effort effort = EffortOf(scene.physics.preset);
  const Inertia inertia = MakeInertia(scene.physics.dt_s / static_cast<float>(effort.substeps));
  (void)Guess(inertia.h);
  organ_blocks_due_ = true;
  Linearise(inertia, {});
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  coarse_.Refresh(sheet, matrix, inertia.inertia, rows_);
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
    for (std::size_t axis = 0; axis < 3; ++axis) {
      matrix.m[d][axis] = m_[d][axis].data();
    }
    matrix.kt[d] = kt_[d].data();
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

/// body(chunk, first row, end row): the unit of work; sums over chunks are taken in their order.
template <class Body>
void AccurateSolver::ForChunks(const Body& body) const {
  for (int row = 0, chunk = 0; row < rows_; row += kChunkRows, ++chunk) {
    body(chunk, row, std::min(row + kChunkRows, rows_));
  }
}

std::uint32_t AccurateSolver::BeginStep() {
  const std::uint32_t resets = particles_->RepairPlaces(kFarthest);
  particles_->RememberPlaces();
  organ_blocks_due_ = true;
  refresh_due_ = true;
  return resets;
}

/// Free particles go on with their velocity; what has no sound velocity stays.
GuessCount AccurateSolver::Guess(float h) {
  const Sheet sheet = MakeSheet();
  const SheetLinearise at = At(place_, nullptr);
  float* const place[3] = {place_.data() + tube_floats_, place_.data() + tube_floats_ + plane_,
                           place_.data() + tube_floats_ + 2 * plane_};
  GuessCount count{};
  ForChunks([&](int, int row0, int row1) {
    const GuessCount rows = kernels_.sheet_guess(sheet, h, at.start, at.velocity, place, row0, row1);
    count.largest_sq = std::max(count.largest_sq, rows.largest_sq);
    count.resets += rows.resets;
  });
  const float* x = particles_->tube();
  for (std::size_t i = 0; i < 4 * std::size_t{tube_count_}; i += 4) {
    const Vec3f step = h * Vec3f(velocity_[i], velocity_[i + 1], velocity_[i + 2]);
    const bool moves = x[i + 3] > 0.0f, sound = step.squaredNorm() < 1e30f;
    count.resets += moves && !sound ? 1 : 0;
    count.largest_sq = moves && sound ? std::max(count.largest_sq, step.squaredNorm()) : count.largest_sq;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place_[i + axis] = x[i + axis] + (moves && sound ? step[static_cast<Eigen::Index>(axis)] : 0.0f);
    }
  }
  return count;
}

void AccurateSolver::ForgetDamagedVelocities() {
  for (std::size_t i = 0; i < velocity_.size(); ++i) {
    velocity_[i] = std::isfinite(velocity_[i]) ? velocity_[i] : 0.0f;
  }
}

void AccurateSolver::PutHeld(std::span<const HeldPlace> held) {
  for (const HeldPlace& h : held) {
    Write(place_.data(), h.at, h.place);
  }
}

double AccurateSolver::EnergyAt(const FloatArray& place, const Inertia& inertia, std::span<const ContactRow> contacts) {
  const Sheet sheet = MakeSheet();
  const Organ organ = MakeOrgan();
  const SheetLinearise at = At(place, nullptr);
  double sum = 0;
  ForChunks([&](int, int row0, int row1) { sum += kernels_.sheet_energy(sheet, inertia, at, row0, row1); });
  sum += kernels_.organ_energy(organ, place.data(), 0, tube_count_);
  const float* x = particles_->tube();
  for (std::size_t v = 0; v < tube_count_; ++v) {
    if (!(x[4 * v + 3] > 0.0f)) {
      continue;
    }
    float energy = 0, load = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float moved = place[4 * v + axis] - x[4 * v + axis];
      load += moved * load_[4 * v + axis];
      energy += 0.5f * inertia.inertia * moved * moved - moved * velocity_[4 * v + axis] / inertia.h -
                moved * inertia.gravity[axis];
    }
    sum += static_cast<double>(organ_mass_[v] * energy - load);
  }
  return sum + elements_.Energy(place.data(), contacts);
}

void AccurateSolver::Linearise(const Inertia& inertia, std::span<const ContactRow> contacts) {
  const auto slot = [&](ParticleRef at) {
    return static_cast<std::uint32_t>(at.base < tube_floats_ ? plane_ + at.base / 4 : at.base - tube_floats_);
  };
  for (const std::uint32_t i : extra_changed_) {
    extra_[i] = base_extra_[i];
  }
  extra_changed_.clear();
  elements_.Touch(place_.data(), particles_->pool(), contacts);
  for (const Element& contact : elements_.touching()) {
    const float stiffness = contact.kt + contact.m.squaredNorm();
    for (int k = 0; k < contact.count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      extra_[slot(contact.at[i])] += stiffness * contact.weight[i] * contact.weight[i];
      extra_changed_.push_back(slot(contact.at[i]));
    }
  }
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const SheetLinearise at = At(place_, &residual_);
  ForChunks([&](int, int row0, int row1) {
    kernels_.sheet_linearise(sheet, inertia, at, matrix, carry_.data(), row0, row1);
  });
  kernels_.middle_blocks(sheet, coarse_.middle(), matrix, inertia.inertia);
  const Organ organ = MakeOrgan();
  const OrganMatrix organ_matrix{organ_c_.data(), organ_f_.data(), organ_stress_.data(), organ_block_.data()};
  kernels_.organ_linearise(organ, organ_matrix, place_.data(), 0, tube_count_);
  kernels_.organ_gather(organ, organ_matrix, place_.data(), residual_.data(), 0, tube_count_);
  // What touches the organ changes its blocks; left alone it does not turn enough in a step to matter.
  if (organ_blocks_due_ || !elements_.touching().empty()) {
    kernels_.organ_blocks(organ, organ_matrix, particles_->tube(), extra_.data() + plane_, inertia.inertia, 0,
                          tube_count_);
    organ_blocks_due_ = !elements_.touching().empty();
  }
  const float* x = particles_->tube();
  for (std::size_t v = 0; v < tube_count_; ++v) {
    const float mass = x[4 * v + 3] > 0.0f ? organ_mass_[v] : 0.0f;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t i = 4 * v + axis;
      const float momentum = (place_[i] - x[i]) * inertia.inertia - velocity_[i] / inertia.h;
      residual_[i] = load_[i] + mass * (inertia.gravity[axis] - momentum) - residual_[i];
    }
  }
  elements_.Linearise(place_.data(), residual_.data());
}

/// z <- M^-1 residual; returns residual . z.
double AccurateSolver::Precondition() {
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const auto planes = [&](FloatArray& field) {
    return Planes{
        {field.data() + tube_floats_, field.data() + tube_floats_ + plane_, field.data() + tube_floats_ + 2 * plane_}};
  };
  Planes r = planes(residual_), z = planes(z_);
  const Middle middle = coarse_.middle();
  ForChunks([&](int, int row0, int row1) { kernels_.sheet_restrict(sheet, middle, r, row_sums_.data(), row0, row1); });
  coarse_.Solve(row_sums_.data(), residual_.data(), particles_->tube());
  ForChunks([&](int chunk, int row0, int row1) {
    partial_[static_cast<std::size_t>(chunk)] = kernels_.sheet_precondition(sheet, middle, matrix, r, z, row0, row1);
  });
  double sum = 0;
  for (const double part : partial_) {
    sum += part;
  }
  for (std::size_t v = 0; v < tube_count_; ++v) {
    const float* block = organ_block_.data() + 12 * v;
    const float* b = residual_.data() + 4 * v;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      z_[4 * v + axis] = block[axis] * b[0] + block[4 + axis] * b[1] + block[8 + axis] * b[2];
    }
  }
  coarse_.Prolong(particles_->tube(), z_.data());
  for (std::size_t i = 0; i < 4 * std::size_t{tube_count_}; i += 4) {
    sum += static_cast<double>(z_[i] * residual_[i] + z_[i + 1] * residual_[i + 1] + z_[i + 2] * residual_[i + 2]);
  }
  return sum;
}

/// q <- A p; returns p . q.
double AccurateSolver::Apply(const FloatArray& direction, float inertia) {
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const float* const p[3] = {direction.data() + tube_floats_, direction.data() + tube_floats_ + plane_,
                             direction.data() + tube_floats_ + 2 * plane_};
  float* const q[3] = {q_.data() + tube_floats_, q_.data() + tube_floats_ + plane_,
                       q_.data() + tube_floats_ + 2 * plane_};
  ForChunks([&](int chunk, int row0, int row1) {
    partial_[static_cast<std::size_t>(chunk)] =
        kernels_.sheet_apply(sheet, inertia, matrix, p, q, carry_.data(), row0, row1);
  });
  double sum = 0;
  for (const double part : partial_) {
    sum += part;
  }
  const Organ organ = MakeOrgan();
  const OrganMatrix organ_matrix{organ_c_.data(), organ_f_.data(), organ_stress_.data(), organ_block_.data()};
  kernels_.organ_stress(organ, organ_matrix, direction.data(), 0, tube_count_);
  kernels_.organ_gather(organ, organ_matrix, direction.data(), q_.data(), 0, tube_count_);
  for (std::size_t v = 0; v < tube_count_; ++v) {
    for (std::size_t i = 4 * v; i < 4 * v + 3; ++i) {
      q_[i] += organ_mass_[v] * inertia * direction[i];
      sum += static_cast<double>(q_[i] * direction[i]);
    }
  }
  return sum + elements_.Apply(direction.data(), q_.data());
}

/// Preconditioned conjugate gradients from d = 0; the residual is then that of place + d.
void AccurateSolver::Solve(float inertia, int iterations) {
  const std::size_t count = tube_floats_ + 3 * plane_;
  double rz = Precondition();
  const FloatArray* direction = &z_;
  for (int i = 0; i < iterations; ++i) {
    const double curvature = Apply(*direction, inertia);
    // Nothing left to solve, or not finite: Finish counts what is not.
    const bool stop = !(rz > 0.0) || !(curvature > 0.0);
    const auto alpha = stop ? 0.0f : static_cast<float>(rz / curvature);
    (i == 0 ? kernels_.start : kernels_.advance)(alpha, direction->data(), q_.data(), d_.data(), residual_.data(),
                                                 count);
    if (stop) {
      return;
    }
    if (i + 1 < iterations) {
      if (i == 0) {
        std::swap(z_, p_);
      }
      const double next = Precondition();
      kernels_.combine(z_.data(), static_cast<float>(next / rz), p_.data(), count);
      direction = &p_;
      rz = next;
    }
  }
}

float AccurateSolver::LargestCorrection() const {
  float largest = 0;
  for (std::size_t i = 0; i < 4 * std::size_t{tube_count_}; i += 4) {
    largest = std::max(largest, d_[i] * d_[i] + d_[i + 1] * d_[i + 1] + d_[i + 2] * d_[i + 2]);
  }
  return std::sqrt(std::max(largest, kernels_.largest(d_.data() + tube_floats_, plane_, plane_)));
}

void AccurateSolver::LimitCorrection(float largest) {
  if (largest <= kLargestCorrection) {
    return;
  }
  const auto limit = [](float* x, float* y, float* z) {
    const float length = std::sqrt(*x * *x + *y * *y + *z * *z);
    if (length > kLargestCorrection) {
      const float part = kLargestCorrection / length;
      *x *= part;
      *y *= part;
      *z *= part;
    }
  };
  for (std::size_t i = 0; i < 4 * std::size_t{tube_count_}; i += 4) {
    limit(&d_[i], &d_[i + 1], &d_[i + 2]);
  }
  float* x = d_.data() + tube_floats_;
  for (std::size_t i = 0; i < plane_; ++i) {
    limit(x + i, x + plane_ + i, x + 2 * plane_ + i);
  }
}

/// Positions and velocities from place + d. What is not finite stays where it was, at rest.
SubstepReport AccurateSolver::Finish(float h) {
  SubstepReport report;
  float largest = 0;
  const float inverse_h = 1.0f / h;
  const auto finish = [&](std::size_t i, float w) {
    float* x = particles_->pool() + i;
    float v[3], square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      v[axis] = (place_[i + axis] + d_[i + axis] - x[axis]) * inverse_h;
      square += v[axis] * v[axis];
    }
    if (!(square < 1e30f)) {
      report.resets += w > 0.0f ? 1 : 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        velocity_[i + axis] = 0;
      }
      return;
    }
    if (square > kLargestSpeed * kLargestSpeed) {
      const float part = kLargestSpeed / std::sqrt(square);
      for (float& component : v) {
        component *= part;
      }
      square = kLargestSpeed * kLargestSpeed;
    }
    largest = w > 0.0f ? std::max(largest, square) : largest;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      x[axis] += h * v[axis];
      velocity_[i + axis] = v[axis];
    }
  };
  for (std::size_t i = 0; i < 4 * std::size_t{tube_count_}; i += 4) {
    finish(i, particles_->tube()[i + 3]);
  }
  const auto planes = [&](FloatArray& field) {
    float* at = field.data() + tube_floats_;
    return Planes{{at, at + plane_, at + 2 * plane_}};
  };
  Planes place = planes(place_), d = planes(d_), velocity = planes(velocity_);
  float* const x[3] = {particles_->plane(0), particles_->plane(1), particles_->plane(2)};
  const FinishCount sheet = kernels_.finish(place, d, particles_->plane(3), h, kLargestSpeed, x, velocity, plane_);
  report.resets += sheet.resets;
  largest = std::max(largest, sheet.largest_speed_sq);
  report.largest_speed_m_s = std::sqrt(largest);
  return report;
}

SubstepReport AccurateSolver::Substep(float h, int iterations, std::span<const HeldPlace> held,
                                      std::span<ContactRow> contacts) {
  const Inertia inertia = MakeInertia(h);
  const GuessCount guess = Guess(h);
  if (guess.resets > 0) {
    ForgetDamagedVelocities();
  }
  PutHeld(held);
  bool searched = false;
  if (guess.largest_sq > kDoubtfulGuess * kDoubtfulGuess) {
    const double moving = EnergyAt(place_, inertia, contacts);
    (void)Guess(0.0f);
    PutHeld(held);
    if (moving < EnergyAt(place_, inertia, contacts)) {
      (void)Guess(h);
      PutHeld(held);
    }
    searched = true;
  }
  Linearise(inertia, contacts);
  if (refresh_due_) {
    coarse_.Refresh(MakeSheet(), MakeMatrix(), inertia.inertia, kRefreshRows);
    refresh_due_ = false;
  }
  Solve(inertia.inertia, iterations);
  const float largest = LargestCorrection();
  LimitCorrection(largest);
  if (largest > kDoubtfulCorrection) {
    searched = true;
    const double before = EnergyAt(place_, inertia, contacts);
    const std::size_t count = tube_floats_ + 3 * plane_;
    for (int halving = 0; halving <= kHalvings; ++halving) {
      for (std::size_t i = 0; i < count; ++i) {
        q_[i] = place_[i] + d_[i];
      }
      if (EnergyAt(q_, inertia, contacts) <= before || halving == kHalvings) {
        break;
      }
      for (std::size_t i = 0; i < count; ++i) {
        d_[i] *= 0.5f;
      }
    }
  }
  // Before the particles move on: their start is still in the store.
  for (std::size_t i = 0; !contacts.empty() && i < tube_floats_ + 3 * plane_; ++i) {
    q_[i] = place_[i] + d_[i];
  }
  Elements::WriteForces(q_.data(), particles_->pool(), contacts);
  SubstepReport report = Finish(h);
  report.largest_correction_m = largest;
  report.searched = searched;
  report.resets += guess.resets;
  return report;
}

Vec3f AccurateSolver::ForceOn(ParticleRef at) const { return Read(residual_.data(), at); }
Vec3f AccurateSolver::Velocity(ParticleRef at) const { return Read(velocity_.data(), at); }
void AccurateSolver::SetVelocity(ParticleRef at, const Vec3f& v) { Write(velocity_.data(), at, v); }
void AccurateSolver::Stop() { std::fill_n(velocity_.data(), velocity_.size(), 0.0f); }

}  // namespace fulcrum::physics::accurate
