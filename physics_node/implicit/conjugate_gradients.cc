#include "physics_node/implicit/conjugate_gradients.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics_node/implicit/phases.h"
#include "physics_node/implicit/substep.h"

namespace fulcrum::physics::implicit {
namespace {

/// Correction from which on it is compared in energy with the prediction [m]: up to here the linearisation holds.
/// Assumed.
constexpr float kDoubtfulCorrection_m = 0.0002f;
/// No particle is corrected by more in one solve [m]. Assumed.
constexpr float kLargestCorrection_m = 0.003f;
/// Of a correction that raises the energy: down to a sixteenth. Assumed.
constexpr int kHalvings = 4;

void ShortenCorrections(const FieldLayout& layout, FloatArray* d) {
  const auto shorten = [](float* x, float* y, float* z) {
    const float length = std::sqrt(*x * *x + *y * *y + *z * *z);
    if (length > kLargestCorrection_m) {
      const float part = kLargestCorrection_m / length;
      *x *= part;
      *y *= part;
      *z *= part;
    }
  };
  float* const tube = d->data();
  for (std::size_t i = 0; i < kVertexFloats * layout.tube_count; i += kVertexFloats) {
    shorten(tube + i, tube + i + 1, tube + i + 2);
  }
  const auto [x, y, z] = layout.Planes(d);
  for (std::size_t i = 0; i < layout.plane; ++i) {
    shorten(x + i, y + i, z + i);
  }
}

/// Halves the correction until the energy is no larger than without it; true: it did. The trial point is in Krylov q.
bool SearchAlongCorrection(const SolverContext& context, const Inertia& inertia, std::span<const ContactRow> contacts,
                           SolverState* state, SolverScratch* scratch) {
  const FieldLayout& layout = context.model.layout;
  const FloatArray& point = state->linearisation.point;
  FloatArray &d = scratch->krylov.d, &trial = scratch->krylov.q;
  const double before = EnergyAt(context, point, inertia, contacts, state, scratch);
  // Elements and contacts of what is computed also join particles that are not.
  const bool part = !state->regions.all_computed();
  if (part) std::copy_n(point.data(), layout.tube_floats + 3 * layout.plane, trial.data());
  for (int halving = 0;; ++halving) {
    ForTasks(&context.workers, state->regions.computed(), [&](const Task& task, int, int) {
      ForPieces(layout, task, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i) {
          trial[i] = point[i] + d[i];
        }
      });
    });
    if (EnergyAt(context, trial, inertia, contacts, state, scratch) <= before || halving == kHalvings) {
      if (part) std::fill_n(trial.data(), layout.tube_floats + 3 * layout.plane, 0.0f);
      return halving > 0;
    }
    for (std::size_t i = 0; i < layout.tube_floats + 3 * layout.plane; ++i) {
      d[i] *= 0.5f;
    }
  }
}

}  // namespace

/// Krylov z <- M r; the residual's part for the hats is in row_sums already. Returns r . z.
double LinearSolver::Precondition() {
  const auto r = context_.model.layout.Planes(std::as_const(state_.linearisation.residual));
  const auto z = context_.model.layout.Planes(&scratch_.krylov.z);
  const float* const residual = state_.linearisation.residual.data();
  const RegionSet& computed = state_.regions.computed();
  const float* const tube = context_.particles.tube();
  state_.coarse.Solve(computed.tasks, scratch_.row_sums.data(), residual, tube, &context_.workers);
  ForTasks(&context_.workers, computed, [&](const Task& task, int index, int) {
    double& partial = scratch_.partial_sums[static_cast<std::size_t>(index)];
    if (task.sheet) {
      partial = context_.kernels.sheet.precondition(system_.sheet, system_.hats, system_.sheet_matrix, r.data(),
                                                    z.data(), task.first, task.end);
    } else {
      float* const tube_z = scratch_.krylov.z.data();
      (void)context_.kernels.organ.block_solve(system_.organ_matrix, residual, tube_z, Vertex(task.first),
                                               Vertex(task.end));
      partial = state_.coarse.Prolong(tube, residual, tube_z, task.first, task.end);
    }
  });
  return SumInOrder(scratch_.partial_sums, computed.tasks.size());
}

double LinearSolver::Apply(const FloatArray& direction, const RegionSet& regions, const Selection& selection) {
  const auto p = context_.model.layout.Planes(direction);
  const auto q = context_.model.layout.Planes(&scratch_.krylov.q);
  double of_hinges = 0, of_bindings = 0;
  ForTasksBeside(
      &context_.workers, 0, static_cast<int>(regions.patches.size()),
      [&](int index, int) {
        const Task& task = regions.patches[static_cast<std::size_t>(index)];
        context_.kernels.organ.stress(system_.organ, system_.organ_matrix, direction.data(), Vertex(task.first),
                                      Vertex(task.end));
      },
      [&] { of_hinges = state_.elements.MultiplyHinges(direction.data(), selection); },
      [&] { of_bindings = state_.elements.MultiplyBindingsAndContacts(direction.data(), selection); });
  ForTasks(&context_.workers, regions, [&](const Task& task, int index, int worker) {
    float* const carry = scratch_.carry[static_cast<std::size_t>(worker)].data();
    scratch_.partial_sums[static_cast<std::size_t>(index)] =
        task.sheet
            ? context_.kernels.sheet.apply(system_.sheet, system_.inertia, system_.sheet_matrix, p.data(), q.data(),
                                           carry, task.first, task.end)
            : context_.kernels.organ.apply(system_.organ, system_.organ_matrix, system_.inertia, direction.data(),
                                           scratch_.krylov.q.data(), Vertex(task.first), Vertex(task.end));
  });
  return SumInOrder(scratch_.partial_sums, regions.tasks.size()) + (of_hinges + of_bindings) +
         state_.elements.AddContactProduct(direction.data(), 1.0f, scratch_.krylov.q.data());
}

/// p . A p in one phase. Leaves the stress along p and the products of the elements with it.
double LinearSolver::Curvature(const FloatArray& direction) {
  const auto p = context_.model.layout.Planes(direction);
  const Regions& regions = state_.regions;
  const RegionSet& computed = regions.computed();
  const auto sheet_tasks = static_cast<std::size_t>(computed.sheet_tasks);
  double of_hinges = 0, of_bindings = 0;
  ForTasksBeside(
      &context_.workers, computed.sheet_tasks, static_cast<int>(computed.patches.size()),
      [&](int index, int) {
        const auto i = static_cast<std::size_t>(index);
        const Task& task = i < sheet_tasks ? computed.tasks[i] : computed.patches[i - sheet_tasks];
        double& partial = scratch_.partial_sums[i];
        if (task.sheet) {
          // Edges from a row that is not computed belong to no other task.
          const bool above = task.first > 0 && !regions.computed(regions.partition().At(true, task.first - 1));
          partial = context_.kernels.sheet.curvature(system_.sheet, system_.inertia, system_.sheet_matrix, p.data(),
                                                     above, task.first, task.end);
        } else {
          partial = context_.kernels.organ.curvature(system_.organ, system_.organ_matrix, system_.inertia,
                                                     direction.data(), Vertex(task.first), Vertex(task.end));
        }
      },
      [&] { of_hinges = state_.elements.MultiplyHinges(direction.data(), state_.elements.computed()); },
      [&] { of_bindings = state_.elements.MultiplyBindingsAndContacts(direction.data(), state_.elements.computed()); });
  return SumInOrder(scratch_.partial_sums, sheet_tasks + computed.patches.size()) + (of_hinges + of_bindings) +
         state_.elements.guard().Curvature(direction.data());
}

/// d, or its increment, from the last two directions; the residual, where it is wanted, is completed without the part
/// of `before` that Solve has subtracted already. After Curvature of z; q is that of p.
void LinearSolver::MakeLastStep(const LastStep& step, bool adds) {
  const FieldLayout& layout = context_.model.layout;
  const SheetKernels& sheet = context_.kernels.sheet;
  const OrganKernels& organ = context_.kernels.organ;
  KrylovVectors& v = scratch_.krylov;
  FloatArray& residual = state_.linearisation.residual;
  // Without a direction before it, p is undefined and may not be finite.
  FloatArray& before = step.before == 0.0f ? v.z : v.p;
  const auto p = layout.Planes(&before), z = layout.Planes(&v.z), q = layout.Planes(&v.q), d = layout.Planes(&v.d);
  const RegionSet& computed = state_.regions.computed();
  const std::span<const Task> tasks = computed.tasks, wanted = scratch_.residual_regions.tasks;
  std::fill(scratch_.correction_sq.begin(), scratch_.correction_sq.end(), 0.0f);
  const auto take_step = [&](const Task& task) {
    ForRegions(context_.model.partition, task, [&](int region, int first, int end) {
      scratch_.correction_sq[static_cast<std::size_t>(region)] =
          task.sheet
              ? sheet.step(system_.sheet, step.before, p.data(), step.alpha, z.data(), adds, d.data(), first, end)
              : organ.step(step.before, before.data(), step.alpha, v.z.data(), adds, v.d.data(), Vertex(first),
                           Vertex(end));
    });
  };
  const auto complete_residual = [&](const Task& task, int worker) {
    if (step.beta != 0.0f) {
      ForPieces(layout, task, [&](std::size_t first, std::size_t count) {
        context_.kernels.field.add(-step.alpha * step.beta, v.q.data() + first, residual.data() + first, count);
      });
    }
    if (task.sheet) {
      sheet.apply(system_.sheet, system_.inertia, system_.sheet_matrix, z.data(), q.data(),
                  scratch_.carry[static_cast<std::size_t>(worker)].data(), task.first, task.end);
    } else {
      organ.apply(system_.organ, system_.organ_matrix, system_.inertia, v.z.data(), v.q.data(), Vertex(task.first),
                  Vertex(task.end));
    }
    AddElements(task, &v.q);
    ForPieces(layout, task, [&](std::size_t first, std::size_t count) {
      context_.kernels.field.add(-step.alpha, v.q.data() + first, residual.data() + first, count);
    });
  };
  context_.workers.AlternateOrder();
  context_.workers.Run(static_cast<int>(tasks.size() + wanted.size()), computed.sheet_tasks,
                       [&](int index, int worker) {
                         const auto i = static_cast<std::size_t>(index);
                         if (i < tasks.size()) {
                           take_step(tasks[i]);
                         } else {
                           complete_residual(wanted[i - tasks.size()], worker);
                         }
                       });
  state_.elements.AddContactProduct(v.z.data(), -step.alpha, residual.data());
}

void LinearSolver::SelectResidual(std::span<const std::uint8_t> regions) {
  RegionSet& selected = scratch_.residual_regions;
  if (std::equal(regions.begin(), regions.end(), selected.marked.begin())) {
    return;
  }
  std::copy(regions.begin(), regions.end(), selected.marked.begin());
  context_.model.partition.FindTasks(&selected);
}

void LinearSolver::AddElements(const Task& task, FloatArray* field) const {
  ForRegions(context_.model.partition, task,
             [&](int region, int, int) { state_.elements.AddInRegion(region, field->data()); });
}

/// The hats' part of the residual of a task.
void LinearSolver::RestrictRows(const Task& task) {
  if (task.sheet) {
    const auto r = context_.model.layout.Planes(std::as_const(state_.linearisation.residual));
    context_.kernels.sheet.restrict_rows(system_.sheet, system_.hats, r.data(), scratch_.row_sums.data(), task.first,
                                         task.end);
  }
}

/// Adds the forces of bindings and hinges that the linearisation has left out, and restricts the residual.
void LinearSolver::StartResidual() {
  Linearisation& at = state_.linearisation;
  ForTasks(&context_.workers, state_.regions.computed(), [&](const Task& task, int, int) {
    if (at.lacks_element_forces) {
      AddElements(task, &at.residual);
    }
    RestrictRows(task);
  });
  at.lacks_element_forces = false;
}

/// The residual along a direction by alpha, and d too unless the last step includes it; restricts the residual.
void LinearSolver::Advance(const FloatArray& direction, float alpha, bool first, bool step_follows) {
  const FieldKernels& kernels = context_.kernels.field;
  KrylovVectors& v = scratch_.krylov;
  FloatArray& residual = state_.linearisation.residual;
  ForTasks(&context_.workers, state_.regions.computed(), [&](const Task& task, int, int) {
    AddElements(task, &v.q);
    ForPieces(context_.model.layout, task, [&](std::size_t begin, std::size_t count) {
      float *q = v.q.data() + begin, *r = residual.data() + begin, *d = v.d.data() + begin;
      if (step_follows) {
        kernels.add(-alpha, q, r, count);
      } else if (first) {
        kernels.start(alpha, direction.data() + begin, q, d, r, count);
      } else {
        kernels.advance(alpha, direction.data() + begin, q, d, r, count);
      }
    });
    RestrictRows(task);
  });
}

void LinearSolver::Solve(int iterations) {
  KrylovVectors& v = scratch_.krylov;
  StartResidual();
  double rz = Precondition(), curvature = 0;
  LastStep step;
  for (int i = 0; i + 1 < iterations; ++i) {
    const bool last_but_one = i + 2 == iterations;
    const FloatArray& direction = i == 0 ? v.z : v.p;
    curvature = Apply(direction);
    // Nothing is left to solve, or it is not finite: Finish counts what is not.
    if (!(rz > 0.0) || !(curvature > 0.0)) {
      MakeLastStep({}, i > 0);
      return;
    }
    const auto alpha = static_cast<float>(rz / curvature);
    Advance(direction, alpha, i == 0, last_but_one);
    if (i == 0) {
      std::swap(v.z, v.p);
    }
    const double next = Precondition();
    step.beta = static_cast<float>(next / rz);
    rz = next;
    if (last_but_one) {
      step.before = alpha;
      break;
    }
    ForTasks(&context_.workers, state_.regions.computed(), [&](const Task& task, int, int) {
      ForPieces(context_.model.layout, task, [&](std::size_t first, std::size_t count) {
        context_.kernels.field.combine(v.z.data() + first, step.beta, v.p.data() + first, count);
      });
    });
  }
  const auto beta = static_cast<double>(step.beta);
  curvature = Curvature(v.z) - beta * beta * curvature;
  if (rz > 0.0 && curvature > 0.0) {
    step.alpha = static_cast<float>(rz / curvature);
    step.before += step.alpha * step.beta;
  }
  MakeLastStep(step, iterations > 2);
}

void LinearSolver::DescendInContactZone() {
  const FieldLayout& layout = context_.model.layout;
  const Kernels& kernels = context_.kernels;
  ContactZone& zone = state_.contact_zone;
  KrylovVectors& v = scratch_.krylov;
  FloatArray& residual = state_.linearisation.residual;
  const auto r = layout.Planes(std::as_const(residual)), d = layout.Planes(std::as_const(v.d));
  const auto z = layout.Planes(&zone.direction);
  ForTasks(&context_.workers, zone.inner, [&](const Task& task, int index, int) {
    scratch_.partial_sums[static_cast<std::size_t>(index)] =
        task.sheet
            ? kernels.sheet.block_solve(system_.sheet, system_.sheet_matrix, r.data(), z.data(), task.first, task.end)
            : kernels.organ.block_solve(system_.organ_matrix, residual.data(), zone.direction.data(),
                                        Vertex(task.first), Vertex(task.end));
  });
  const double rz = SumInOrder(scratch_.partial_sums, zone.inner.tasks.size());
  const double curvature = Apply(zone.direction, zone.outer, zone.elements);
  state_.elements.Add(zone.elements, v.q.data());
  if (!(rz > 0.0) || !(curvature > 0.0)) {
    return;
  }
  const auto alpha = static_cast<float>(rz / curvature);
  ForTasks(&context_.workers, zone.outer, [&](const Task& task, int, int) {
    ForPieces(layout, task, [&](std::size_t first, std::size_t count) {
      kernels.field.advance(alpha, zone.direction.data() + first, v.q.data() + first, v.d.data() + first,
                            residual.data() + first, count);
    });
    ForRegions(context_.model.partition, task, [&](int region, int first, int end) {
      scratch_.correction_sq[static_cast<std::size_t>(region)] =
          task.sheet ? kernels.sheet.largest(system_.sheet, d.data(), first, end)
                     : kernels.organ.largest(v.d.data(), Vertex(first), Vertex(end));
    });
  });
}

Correction LimitCorrection(const SolverContext& context, const Inertia& inertia, std::span<const ContactRow> contacts,
                           SolverState* state, SolverScratch* scratch) {
  const std::vector<float>& by_region = scratch->correction_sq;
  Correction correction;
  correction.largest_m = std::sqrt(*std::max_element(by_region.begin(), by_region.end()));
  if (correction.largest_m > kLargestCorrection_m) {
    ShortenCorrections(context.model.layout, &scratch->krylov.d);
    correction.shortened = true;
  }
  if (correction.largest_m > kDoubtfulCorrection_m) {
    correction.shortened |= SearchAlongCorrection(context, inertia, contacts, state, scratch);
    correction.line_searched = true;
  }
  return correction;
}

}  // namespace fulcrum::physics::implicit
