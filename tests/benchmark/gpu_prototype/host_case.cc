#include "tests/benchmark/gpu_prototype/host_case.h"

#include <time.h>

#include <algorithm>
#include <utility>

#include "physics_node/implicit/phases.h"

namespace fulcrum::physics {
namespace {

using implicit::Task;

constexpr int kIterations = 2;
/// The pull: 75 nodes at 60 mm/s, as the standard case.
constexpr Index kHalfRows = 7, kHalfColumns = 2;
constexpr float kLiftOfStep_m = 0.0006f;

}  // namespace

double ProcessorUs() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

HostCase::HostCase(const SceneView& view, int frames, std::vector<double>* step_ms)
    : scene(view),
      elastic(BuildElasticModel(scene)),
      particles(scene),
      tissue(scene, &particles),
      model(scene, elastic, particles),
      context{implicit::KernelsFor(), model, particles, workers},
      state(scene, elastic, tissue, context),
      scratch(context, state.coarse.row_width()),
      inertia(model.InertiaOf(scene.physics.dt_s / 2)),
      residual_(model.layout.floats) {
  Pull(frames, step_ms);
  state.regions.SleepOthers();
  state.regions.Rebuild();
  state.elements.SelectComputed(state.regions);
  state.coarse.UpdateRegions(state.regions);
  const implicit::BoundaryConditions boundary{held_, {}};
  (void)implicit::Predict(context, inertia, boundary, &state, &scratch);
  implicit::Linearise(context, inertia, {}, &state, &scratch);
  const implicit::LinearSystem system = System();
  state.coarse.Assemble(system.sheet, system.sheet_matrix, inertia.inertia);
  std::copy_n(state.linearisation.residual.data(), residual_.size(), residual_.data());
}

void HostCase::Pull(int frames, std::vector<double>* step_ms) {
  const Index row = scene.membrane.rows / 2, column = scene.membrane.cols / 2;
  for (Index r = row - kHalfRows; r <= row + kHalfRows; ++r) {
    for (Index c = column - kHalfColumns; c <= column + kHalfColumns; ++c) {
      const ParticleRef at = particles.NodeRef(r, c);
      particles.SetInverseMass(at, 0);
      held_.push_back({at, particles.At(at)});
    }
  }
  implicit::ImplicitSolver solver(scene, elastic, tissue, &particles);
  solver.Stop();
  const auto lift = [this] {
    for (implicit::HeldPlace& held : held_) held.place.z() += kLiftOfStep_m / 2;
  };
  for (int frame = 0; frame < frames; ++frame) {
    const double begun = ProcessorUs();
    (void)solver.BeginStep();
    for (int substep = 0; substep < 2; ++substep) {
      lift();
      (void)solver.Substep(inertia.h, kIterations, held_, {});
    }
    step_ms->push_back(1e-3 * (ProcessorUs() - begun));
  }
  for (Index p = 0; p < particles.particle_count(); ++p) {
    const ParticleRef at = particles.Ref(p);
    PutField(state.velocity.data(), at, solver.Velocity(at));
  }
  lift();
}

double HostCase::ApplySheet(const FloatArray& p) {
  const implicit::LinearSystem system = System();
  const auto from = model.layout.Planes(p);
  const auto to = model.layout.Planes(&scratch.krylov.q);
  double sum = 0;
  for (const Task& task : state.regions.computed().tasks) {
    if (!task.sheet) continue;
    sum += context.kernels.sheet.apply(system.sheet, system.inertia, system.sheet_matrix, from.data(), to.data(),
                                       scratch.carry[0].data(), task.first, task.end);
  }
  return sum;
}

double HostCase::ApplyOrgan(const FloatArray& p) {
  const implicit::LinearSystem system = System();
  const implicit::OrganKernels& organ = context.kernels.organ;
  const implicit::RegionSet& computed = state.regions.computed();
  for (const Task& task : computed.patches) {
    organ.stress(system.organ, system.organ_matrix, p.data(), implicit::Vertex(task.first), implicit::Vertex(task.end));
  }
  double sum = 0;
  for (const Task& task : computed.tasks) {
    if (task.sheet) continue;
    sum += organ.apply(system.organ, system.organ_matrix, system.inertia, p.data(), scratch.krylov.q.data(),
                       implicit::Vertex(task.first), implicit::Vertex(task.end));
  }
  return sum;
}

void HostCase::LineariseSheet() {
  const implicit::LinearSystem system = System();
  const implicit::SheetFields fields =
      implicit::SheetFieldsAt(context, state, state.linearisation.point, &state.linearisation.residual);
  for (const Task& task : state.regions.computed().tasks) {
    if (!task.sheet) continue;
    context.kernels.sheet.linearise(system.sheet, inertia, fields, system.sheet_matrix, scratch.carry[0].data(), false,
                                    task.first, task.end);
  }
}

std::vector<float> HostCase::Linearisation() {
  const implicit::LinearSystem system = System();
  std::vector<float> planes;
  const auto append = [&](const float* plane) { planes.insert(planes.end(), plane, plane + model.layout.plane); };
  for (const float* kt : system.sheet_matrix.kt) append(kt);
  for (const float* along : system.sheet_matrix.along) append(along);
  for (const float* residual : model.layout.Planes(std::as_const(state.linearisation.residual))) append(residual);
  for (const float* block : system.sheet_matrix.block) append(block);
  for (const auto& half : system.sheet_matrix.coupling) {
    for (const float* coupling : half) append(coupling);
  }
  return planes;
}

void HostCase::ResetResidual() {
  std::copy_n(residual_.data(), residual_.size(), state.linearisation.residual.data());
  state.linearisation.lacks_element_forces = true;
}

void HostCase::Solve() {
  const implicit::LinearSystem system = System();
  implicit::LinearSolver solver(context, system, &state, &scratch);
  solver.Solve(kIterations);
}

void HostCase::SolveLevels(const implicit::LinearSystem& system, std::vector<double>* sums) {
  const implicit::RegionSet& computed = state.regions.computed();
  const float* const residual = state.linearisation.residual.data();
  float* const z = scratch.krylov.z.data();
  state.coarse.Solve(computed.tasks, scratch.row_sums.data(), residual, particles.tube(), &workers);
  sums->clear();
  for (const Task& task : computed.tasks) {
    if (task.sheet) continue;
    (void)context.kernels.organ.block_solve(system.organ_matrix, residual, z, implicit::Vertex(task.first),
                                            implicit::Vertex(task.end));
    sums->push_back(state.coarse.Prolong(particles.tube(), residual, z, task.first, task.end));
  }
}

}  // namespace fulcrum::physics
