#include "physics_node/implicit/implicit_solver.h"

#include <algorithm>
#include <cmath>

#include "physics_node/implicit/for_tasks.h"

namespace fulcrum::physics::implicit {
namespace {

/// No place is so far from the origin [m].
constexpr float kFarthest = 10.0f;

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

ImplicitSolver::ImplicitSolver(const SceneView& scene, const ElasticModel& model, const TissueModel& tissue,
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
      coarse_(scene, model, *particles, kernels),
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
    *a = FloatArray(12 * (tube_count_ + std::size_t{kPatchGroup}));
  }
  organ_stress_ = FloatArray(16 * (tube_count_ + std::size_t{1}));
  const std::size_t pool = particles->raw().size();
  pressed_ = around_ = wanted_ = regions_.MakePart();
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
  for (auto* flags : {&held_before_, &touched_before_, &held_now_, &touched_now_, &pressed_now_, &wanted_now_}) {
    flags->assign(regions, 0);
  }
  stiffened_.assign(regions, 0);
  speed_.assign(regions, 0.0f);
  largest_sq_.assign(regions, 0.0f);
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
  elements_.Divide(regions_);
  elements_.Follow(tissue);
  FollowRegions();
  // The first coarse matrix: all of it, at rest.
  const Effort effort = EffortOf(scene.physics.preset);
  const Inertia inertia = MakeInertia(scene.physics.dt_s / static_cast<float>(effort.substeps));
  (void)Guess(inertia.h, 0.0f);
  Linearise(inertia, {});
  forces_due_ = false;  // Nothing is solved for these.
  coarse_.Renew(MakeSheet(), MakeMatrix(), inertia.inertia);
}

Sheet ImplicitSolver::MakeSheet() const {
  return {rows_,
          slots_,
          {inverse_rest_[0].data(), inverse_rest_[1].data(), inverse_rest_[2].data()},
          {axial_[0].data(), axial_[1].data(), axial_[2].data()},
          stiffening_,
          particles_->plane(3),
          sheet_mass_.data()};
}

SheetMatrix ImplicitSolver::MakeMatrix() {
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

Organ ImplicitSolver::MakeOrgan() const {
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

OrganMatrix ImplicitSolver::MakeOrganMatrix() {
  return {organ_c_.data(), organ_f_.data(), organ_stress_.data(), organ_block_.data()};
}

Inertia ImplicitSolver::MakeInertia(float h) const {
  return {h, (1.0f + damping_ * h) / (h * h), {gravity_.x(), gravity_.y(), gravity_.z()}};
}

SheetLinearise ImplicitSolver::At(const FloatArray& place, FloatArray* residual) {
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

OrganLinearisation ImplicitSolver::OrganAt(const FloatArray& place) {
  return {place.data(), particles_->tube(), velocity_.data(), load_.data(), residual_.data()};
}

std::uint32_t ImplicitSolver::BeginStep() {
  std::uint32_t resets = 0;
  std::array<bool, ParticleStore::kParts> sound{};
  workers_.Run(ParticleStore::kParts, 0, [&](int part, int) {
    const auto [tube, x, y, z, mass] = particles_->Part(part);
    const auto within = [&](std::span<const float> floats, bool xyzw) {
      return kernels_.within(floats.data(), kFarthest, floats.size(), xyzw);
    };
    sound[static_cast<std::size_t>(part)] =
        within(tube, true) && within(x, false) && within(y, false) && within(z, false);
  });
  if (std::find(sound.begin(), sound.end(), false) != sound.end()) {
    resets = particles_->RepairPlaces(kFarthest);
    regions_.WakeAll();
  }
  moved_.swap(moved_asleep_);
  std::fill(moved_asleep_.begin(), moved_asleep_.end(), 0.0f);
  ForTasks([&](const Task& task, int, int) {
    Measure(task, &moved_);
    ForParts(task, [&](std::size_t first, std::size_t count) { particles_->RememberPlaces(first, count); });
  });
  ++steps_;
  organ_blocks_due_ = true;
  refresh_due_ = true;
  return resets;
}

void ImplicitSolver::Measure(const Task& task, std::vector<float>* moved) const {
  if (task.sheet) {
    particles_->MeasureRows(Vertex(task.first), Vertex(task.end), moved->data());
  } else {
    particles_->MeasureTube(Vertex(task.first), Vertex(task.end), moved->data());
  }
}

/// What held particles and contacts begin, move or end wakes the tissue there.
void ImplicitSolver::WakeTouched(std::span<const HeldPlace> held, std::span<const ContactRow> contacts) {
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

/// What is no longer computed does not move, and is no direction of the solve.
void ImplicitSolver::FollowRegions() {
  elements_.FollowRegions(regions_);
  coarse_.FollowRegions(regions_);
  blocks_inertia_ = 0;  // What wakes has old blocks.
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

Vec3f ImplicitSolver::ForceOn(ParticleRef at) const { return FieldAt(residual_.data(), at); }
Vec3f ImplicitSolver::Velocity(ParticleRef at) const { return FieldAt(velocity_.data(), at); }
void ImplicitSolver::SetVelocity(ParticleRef at, const Vec3f& v) {
  PutField(velocity_.data(), at, v);
  regions_.Wake(regions_.Of(at));
}
void ImplicitSolver::Stop() { std::fill_n(velocity_.data(), velocity_.size(), 0.0f); }

}  // namespace fulcrum::physics::implicit
