#include "physics_node/implicit/implicit_solver.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "physics_node/implicit/conjugate_gradients.h"
#include "physics_node/implicit/phases.h"

namespace fulcrum::physics::implicit {
namespace {

/// Coordinates beyond this count as damaged [m]: far outside of a body, far below what overflows when squared.
constexpr float kFarthest_m = 10.0f;

/// A substep longer than this [s] after a correction above this [m], as when taut tissue is let go, takes more
/// iterations: the tissue is back at rest nearly as soon as with an exact solve. With two more the error of a cut
/// grows; shorter substeps converge without (deploy/docs/measurements/physics, Release).
constexpr float kLargeCorrection_m = 0.001f, kLongSubstep_s = 0.004f;
constexpr int kMoreIterations = 4;

/// Time since the last call, or since it was made [ns].
class Lap {
 public:
  std::int64_t operator()() {
    const auto now = std::chrono::steady_clock::now(), last = std::exchange(last_, now);
    return std::chrono::nanoseconds(now - last).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Of TouchedRegions::touched.
constexpr std::uint8_t kTouched = 1, kTouchedByMoving = 2;

/// Raises `moved` by how far the particles of a task are from their previous places.
void MeasureMovement(const ParticleStore& particles, const Task& task, std::vector<float>* moved) {
  if (task.sheet) {
    particles.MeasureRows(Vertex(task.first), Vertex(task.end), moved->data());
  } else {
    particles.MeasureTube(Vertex(task.first), Vertex(task.end), moved->data());
  }
}

/// A task without the vertices of its first and last block that another task has, too.
Task WholeBlocks(const Task& task, Index tube_count) {
  if (task.sheet) return task;
  constexpr int kBlock = static_cast<int>(ParticleStore::kBlockVertices);
  const int first = (task.first + kBlock - 1) / kBlock * kBlock;
  const int end = task.end == static_cast<int>(tube_count) ? task.end : task.end / kBlock * kBlock;
  return {false, first, std::max(first, end)};
}

/// Wakes the regions in which held particles and contacts begin, move or end. `now` is memory.
void WakeTouched(const SolverContext& context, const BoundaryConditions& boundary, TouchedRegions* now,
                 TouchedRegions* last, Regions* regions) {
  const Partition& partition = context.model.partition;
  std::fill(now->held.begin(), now->held.end(), std::uint8_t{0});
  std::fill(now->touched.begin(), now->touched.end(), std::uint8_t{0});
  for (const HeldPlace& held : boundary.held) {
    now->held[static_cast<std::size_t>(partition.Of(held.at))] = 1;
  }
  for (const ContactRow& row : boundary.contacts) {
    if (row.normal.dot(row.At(context.particles.pool())) < row.offset) {
      const auto count = static_cast<std::size_t>(row.count);
      const int body = partition.BodyOf(partition.Of(row.at[0]));
      bool pressed = row.drift.squaredNorm() > 0.0f;  // By something that moves.
      // Parts of a sheet that touch are joined by nothing but the contact.
      const bool of_sheets = Elements::IsOfSheets(row);
      for (std::size_t k = 1; k < count && !pressed; ++k) {
        pressed = (of_sheets || partition.BodyOf(partition.Of(row.at[k])) != body) &&
                  std::any_of(row.at.begin(), row.at.begin() + static_cast<std::ptrdiff_t>(count),
                              [&](ParticleRef at) { return regions->moving(partition.Of(at)); });
      }
      const std::uint8_t how = pressed ? kTouchedByMoving : kTouched;
      for (std::size_t k = 0; k < count; ++k) {
        std::uint8_t& touched = now->touched[static_cast<std::size_t>(partition.Of(row.at[k]))];
        touched = std::max(touched, how);
      }
    }
  }
  for (std::size_t i = 0; i < now->held.size(); ++i) {
    const bool touch_changes = (now->touched[i] != 0) != (last->touched[i] != 0);
    if (now->held[i] != 0 || last->held[i] != 0 || touch_changes || now->touched[i] == kTouchedByMoving) {
      regions->Wake(static_cast<int>(i));
    }
  }
  std::swap(*now, *last);
}

/// What slides on something that moves stays awake, as a neighbour does.
void WakeSliding(const Slides& slides, Regions* regions) {
  const Partition& partition = regions->partition();
  for (const Element& e : slides.elements()) {
    if (std::ranges::any_of(e.at, [&](ParticleRef at) { return regions->moving(partition.Of(at)); })) {
      for (const ParticleRef at : e.at) regions->Wake(partition.Of(at));
    }
  }
}

/// Tissue in a clip of which a part moves stays awake.
void WakeClipped(const Clips& clips, Regions* regions) {
  const Partition& partition = regions->partition();
  clips.ForEach([&](std::span<const ParticleRef> clipped) {
    if (std::ranges::any_of(clipped, [&](ParticleRef at) { return regions->moving(partition.Of(at)); })) {
      for (const ParticleRef at : clipped) regions->Wake(partition.Of(at));
    }
  });
}

/// After a change of the computed regions: elements, levels and blocks follow. What is no longer computed does not move
/// and is no direction of the solve.
void FollowComputedRegions(const SolverContext& context, SolverState* state, KrylovVectors* krylov) {
  const FieldLayout& layout = context.model.layout;
  state->elements.SelectComputed(state->regions);
  state->coarse.UpdateRegions(state->regions);
  state->organ_blocks.inertia = 0;  // Regions that wake have blocks of another linearisation.
  state->contact_zone.outdated = true;
  FloatArray& point = state->linearisation.point;
  for (const int region : state->regions.removed()) {
    const Task extent = context.model.partition.Extent(region);
    MeasureMovement(context.particles, extent, &state->movement.before_sleep);
    ForPieces(layout, extent, [&](std::size_t first, std::size_t count) {
      context.particles.StorePositions(first, count);
      for (FloatArray* field : {&state->velocity, &krylov->z, &krylov->p, &krylov->q, &krylov->d}) {
        std::fill_n(field->data() + first, count, 0.0f);
      }
      for (FloatArray& displacement : state->query_displacement) {
        std::fill_n(displacement.data() + first, count, 0.0f);
      }
      std::copy_n(context.particles.pool() + first, count, point.data() + first);
    });
    for (int v = extent.first; !extent.sheet && v < extent.end; ++v) {
      point[kVertexFloats * static_cast<std::size_t>(v) + 3] = 0;  // A copy of the inverse mass.
    }
  }
}

/// By region: the residual after the solve is a force on held particles, or the descent at contacts continues from it.
void FindWantedResidual(const SolverState& state, std::vector<std::uint8_t>* wanted) {
  for (std::size_t i = 0; i < wanted->size(); ++i) {
    const bool held = state.touched.held[i] != 0 && state.regions.computed(static_cast<int>(i));
    (*wanted)[i] = state.contact_zone.pressed[i] != 0 || held ? 1 : 0;
  }
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

ImplicitSolver::ImplicitSolver(const TissueScene& scene, const ElasticModel& model, const TissueModel& tissue,
                               ParticleStore* particles, int threads, const Kernels& kernels)
    : model_(scene, model, *particles),
      workers_(threads),
      context_{kernels, model_, *particles, workers_},
      state_(scene, model, tissue, context_),
      scratch_(context_, state_.coarse.row_width()) {
  FollowComputedRegions(context_, &state_, &scratch_.krylov);
  // The first coarse matrix: all of it, at rest.
  const Inertia inertia =
      model_.InertiaOf(scene.physics.dt_s / static_cast<float>(EffortOf(scene.physics.preset).substeps));
  PredictAtRest(context_, &state_, &scratch_);
  Linearise(context_, inertia, {}, &state_, &scratch_);
  state_.linearisation.lacks_element_forces = false;  // Nothing is solved here.
  const LinearSystem system(context_, inertia.inertia, &state_, &scratch_);
  state_.coarse.Assemble(system.sheet, system.sheet_matrix, inertia.inertia, state_.elements.slides());
}

void ImplicitSolver::UpdateTopology(const TissueModel& tissue) {
  const GridLayout& grid = model_.grid;
  const auto wake = [&](Index row, Index col) {
    state_.regions.Wake(model_.partition.Of(context_.particles.NodeRef(row, col)));
  };
  for (const Index edge : tissue.edited_edges()) {
    const Index row = edge / 3 / grid.cols, col = edge / 3 % grid.cols, direction = edge % 3;
    state_.edges.Update(tissue, row, col, direction);
    state_.coarse.MarkEdit(row, col, direction);
    // The lower triangle of an edge along a row belongs to the row above.
    wake(row > 0 ? row - 1 : 0, col);
    wake(row, col);
    wake(std::min(row + 1, grid.rows - 1), col);
  }
  state_.edges.FindFrayed();
  state_.coarse.ScaleHats(state_.edges.View(context_.particles.plane(3)));
  state_.elements.UpdateTopology(tissue);
  state_.elements.SelectComputed(state_.regions);
  state_.contact_zone.outdated = true;
}

std::uint32_t ImplicitSolver::BeginStep() {
  ParticleStore& particles = context_.particles;
  std::uint32_t resets = 0;
  std::array<bool, ParticleStore::kParts> sound{};
  workers_.Run(ParticleStore::kParts, 0, [&](int part, int) {
    const auto [tube, x, y, z, mass] = particles.Part(part);
    const auto within = [&](std::span<const float> floats, bool xyzw) {
      return context_.kernels.field.within(floats.data(), kFarthest_m, floats.size(), xyzw);
    };
    sound[static_cast<std::size_t>(part)] =
        within(tube, true) && within(x, false) && within(y, false) && within(z, false);
  });
  if (std::find(sound.begin(), sound.end(), false) != sound.end()) {
    resets = particles.RepairPlaces(kFarthest_m);
    state_.regions.WakeAll();
  }
  Movement& movement = state_.movement;
  movement.of_step.swap(movement.before_sleep);
  std::fill(movement.before_sleep.begin(), movement.before_sleep.end(), 0.0f);
  // A block in which two solids meet is measured here: two tasks would write its movement.
  for (const Index block : model_.partition.split_blocks()) {
    const Index first = block * ParticleStore::kBlockVertices;
    particles.MeasureTube(first, std::min(first + ParticleStore::kBlockVertices, particles.tube_count()),
                          movement.of_step.data());
  }
  ForTasks(&workers_, state_.regions.computed(), [&](const Task& task, int, int) {
    MeasureMovement(particles, WholeBlocks(task, particles.tube_count()), &movement.of_step);
    ForPieces(model_.layout, task,
              [&](std::size_t first, std::size_t count) { particles.StorePositions(first, count); });
  });
  ++state_.steps;
  state_.organ_blocks.step_due = true;
  state_.coarse_due = true;
  return resets;
}

SubstepReport ImplicitSolver::Substep(float h, int iterations, std::span<const HeldPlace> held,
                                      std::span<ContactRow> contacts) {
  Lap lap;
  SubstepTimes times;
  const Inertia inertia = model_.InertiaOf(h);
  const BoundaryConditions boundary{held, contacts};
  WakeTouched(context_, boundary, &scratch_.touched, &state_.touched, &state_.regions);
  // A fold that opens slowly is no rest.
  state_.elements.guard().ForVerticesFound(
      [this](Index v) { state_.regions.Wake(model_.partition.At(false, static_cast<int>(v))); });
  WakeSliding(state_.elements.slides(), &state_.regions);
  if (state_.elements.has_clips()) WakeClipped(state_.elements.clips(), &state_.regions);
  if (state_.regions.Rebuild()) {
    FollowComputedRegions(context_, &state_, &scratch_.krylov);
  }

  const std::uint32_t resets = Predict(context_, inertia, boundary, &state_, &scratch_);
  times.prediction_ns = lap();
  Linearise(context_, inertia, contacts, &state_, &scratch_);
  times.linearisation_ns = lap();

  const LinearSystem system(context_, inertia.inertia, &state_, &scratch_);
  LinearSolver solver(context_, system, &state_, &scratch_);
  FindWantedResidual(state_, &scratch_.wanted);
  solver.SelectResidual(scratch_.wanted);
  const bool flies = h > kLongSubstep_s && state_.largest_correction_m > kLargeCorrection_m;
  solver.Solve(flies ? iterations + kMoreIterations : iterations);
  if (state_.contact_zone.active) {
    solver.DescendInContactZone();
  }
  times.solve_ns = lap();

  const Correction correction = LimitCorrection(context_, inertia, contacts, &state_, &scratch_);
  // Before the update: the start of the substep is still in the store.
  Elements::WriteForces(h, state_.linearisation.point.data(), scratch_.krylov.d.data(), context_.particles.pool(),
                        contacts);
  // A correction that was shortened has another residual.
  if (state_.contact_zone.active && !correction.shortened) {
    state_.elements.WriteUnbalanced(scratch_.krylov.d.data(), state_.linearisation.residual.data(), state_.regions,
                                    contacts);
  }
  SubstepReport report = Finish(context_, h, &state_, &scratch_);
  state_.regions.UpdateSleep(scratch_.speed, h);

  state_.largest_correction_m = report.largest_correction_m = correction.largest_m;
  report.line_searched = correction.line_searched;
  times.update_ns = lap();
  report.times = times;
  report.resets += resets;
  return report;
}

Vec3f ImplicitSolver::ForceOn(ParticleRef at) const { return FieldAt(state_.linearisation.residual.data(), at); }
Vec3f ImplicitSolver::Velocity(ParticleRef at) const { return FieldAt(state_.velocity.data(), at); }
void ImplicitSolver::SetVelocity(ParticleRef at, const Vec3f& v) {
  PutField(state_.velocity.data(), at, v);
  state_.regions.Wake(model_.partition.Of(at));
}
void ImplicitSolver::RestartSlides() { state_.elements.RestartSlides(); }
void ImplicitSolver::SleepStill() {
  state_.regions.SleepStill([&](int region) {
    bool still = true;
    ForPieces(model_.layout, model_.partition.Extent(region), [&](std::size_t first, std::size_t count) {
      const float* velocity = state_.velocity.data() + first;
      still = still && std::all_of(velocity, velocity + count, [](float v) { return v == 0.0f; });
    });
    return still;
  });
}
void ImplicitSolver::Stop() {
  std::fill_n(state_.velocity.data(), state_.velocity.size(), 0.0f);
  state_.regions.SleepOthers();
}

}  // namespace fulcrum::physics::implicit
