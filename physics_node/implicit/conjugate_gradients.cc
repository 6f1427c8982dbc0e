// The linear solve of a substep: conjugate gradients with the three-level preconditioner, a phase at a time over what
// is awake.
#include <algorithm>
#include <cmath>

#include "physics_node/implicit/for_tasks.h"
#include "physics_node/implicit/implicit_solver.h"

namespace fulcrum::physics::implicit {
namespace {

/// No particle is corrected by more in one solve [m].
constexpr float kLargestCorrection = 0.003f;
constexpr int kHalvings = 4;

}  // namespace

/// z <- M^-1 residual, whose part for the middle level is in row_sums_ already; returns residual . z.
double ImplicitSolver::Precondition() {
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const OrganMatrix organ_matrix = MakeOrganMatrix();
  const Middle middle = coarse_.middle();
  const float* const r[3] = {residual_.data() + tube_floats_, residual_.data() + tube_floats_ + plane_,
                             residual_.data() + tube_floats_ + 2 * plane_};
  float* const z[3] = {z_.data() + tube_floats_, z_.data() + tube_floats_ + plane_,
                       z_.data() + tube_floats_ + 2 * plane_};
  coarse_.Solve(regions_.part().tasks, row_sums_.data(), residual_.data(), particles_->tube(), &workers_);
  ForTasks([&](const Task& task, int index, int) {
    double& partial = partial_[static_cast<std::size_t>(index)];
    if (task.sheet) {
      partial = kernels_.sheet_precondition(sheet, middle, matrix, r, z, task.first, task.end);
    } else {
      (void)kernels_.organ_block_solve(organ_matrix, residual_.data(), z_.data(), Vertex(task.first), Vertex(task.end));
      partial = coarse_.Prolong(particles_->tube(), residual_.data(), z_.data(), task.first, task.end);
    }
  });
  return SumOfPartials(regions_.part().tasks.size());
}

double ImplicitSolver::Apply(const FloatArray& direction, float inertia, const Part& part, const Selection& elements) {
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const Organ organ = MakeOrgan();
  const OrganMatrix organ_matrix = MakeOrganMatrix();
  const float* const p[3] = {direction.data() + tube_floats_, direction.data() + tube_floats_ + plane_,
                             direction.data() + tube_floats_ + 2 * plane_};
  float* const q[3] = {q_.data() + tube_floats_, q_.data() + tube_floats_ + plane_,
                       q_.data() + tube_floats_ + 2 * plane_};
  double of_hinges = 0, of_others = 0;
  ForTasksBeside(
      0, static_cast<int>(part.patches.size()),
      [&](int index, int) {
        const Task& task = part.patches[static_cast<std::size_t>(index)];
        kernels_.organ_stress(organ, organ_matrix, direction.data(), Vertex(task.first), Vertex(task.end));
      },
      [&] { of_hinges = elements_.MultiplyHinges(direction.data(), elements); },
      [&] { of_others = elements_.MultiplyOthers(direction.data(), elements); });
  ForTasks(part, [&](const Task& task, int index, int worker) {
    partial_[static_cast<std::size_t>(index)] =
        task.sheet ? kernels_.sheet_apply(sheet, inertia, matrix, p, q, carry_[static_cast<std::size_t>(worker)].data(),
                                          task.first, task.end)
                   : kernels_.organ_apply(organ, organ_matrix, inertia, direction.data(), q_.data(), Vertex(task.first),
                                          Vertex(task.end));
  });
  return SumOfPartials(part.tasks.size()) + (of_hinges + of_others) +
         elements_.AddContactProduct(direction.data(), 1.0f, q_.data());
}

double ImplicitSolver::Curvature(const FloatArray& direction, float inertia) {
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const Organ organ = MakeOrgan();
  const OrganMatrix organ_matrix = MakeOrganMatrix();
  const float* const p[3] = {direction.data() + tube_floats_, direction.data() + tube_floats_ + plane_,
                             direction.data() + tube_floats_ + 2 * plane_};
  const std::span<const Task> tasks = regions_.part().tasks, patches = regions_.part().patches;
  const auto sheet_tasks = static_cast<std::size_t>(regions_.part().sheet_tasks);
  double of_hinges = 0, of_others = 0;
  ForTasksBeside(
      regions_.part().sheet_tasks, static_cast<int>(patches.size()),
      [&](int index, int) {
        const auto i = static_cast<std::size_t>(index);
        const Task& task = i < sheet_tasks ? tasks[i] : patches[i - sheet_tasks];
        if (task.sheet) {
          // Edges from a row that is not computed are nobody else's.
          const bool above = task.first > 0 && !regions_.computed(regions_.At(true, task.first - 1));
          partial_[i] = kernels_.sheet_curvature(sheet, inertia, matrix, p, above, task.first, task.end);
        } else {
          partial_[i] = kernels_.organ_curvature(organ, organ_matrix, inertia, direction.data(), Vertex(task.first),
                                                 Vertex(task.end));
        }
      },
      [&] { of_hinges = elements_.MultiplyHinges(direction.data(), elements_.computed()); },
      [&] { of_others = elements_.MultiplyOthers(direction.data(), elements_.computed()); });
  return SumOfPartials(sheet_tasks + patches.size()) + (of_hinges + of_others) +
         elements_.guard().Curvature(direction.data());
}

/// d, or its increment, <- before p + alpha (z + beta p); the residual, where it is wanted, goes on from that without
/// the second part. After Curvature of z; q is that of p.
void ImplicitSolver::LastStep(const Step& last, bool adds, float inertia) {
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const Organ organ = MakeOrgan();
  const OrganMatrix organ_matrix = MakeOrganMatrix();
  const auto planes = [&](FloatArray& field) {
    float* at = field.data() + tube_floats_;
    return std::array<float*, 3>{at, at + plane_, at + 2 * plane_};
  };
  // Without a direction before it, p is anything, and need not be finite.
  FloatArray& before = last.of_before == 0.0f ? z_ : p_;
  const std::array<float*, 3> p = planes(before), z = planes(z_), q = planes(q_), d = planes(d_);
  const std::span<const Task> tasks = regions_.part().tasks, wanted = wanted_.tasks;
  std::fill(largest_sq_.begin(), largest_sq_.end(), 0.0f);
  workers_.Turn();
  workers_.Run(static_cast<int>(tasks.size() + wanted.size()), regions_.part().sheet_tasks, [&](int index, int worker) {
    const auto i = static_cast<std::size_t>(index);
    if (i < tasks.size()) {
      ForRegions(tasks[i], [&](int region, int first, int end) {
        largest_sq_[static_cast<std::size_t>(region)] =
            tasks[i].sheet
                ? kernels_.sheet_step(sheet, last.of_before, p.data(), last.alpha, z.data(), adds, d.data(), first, end)
                : kernels_.organ_step(last.of_before, before.data(), last.alpha, z_.data(), adds, d_.data(),
                                      Vertex(first), Vertex(end));
      });
      return;
    }
    const Task& task = wanted[i - tasks.size()];
    if (last.beta != 0.0f) {
      ForParts(task, [&](std::size_t first, std::size_t count) {
        kernels_.add(-last.alpha * last.beta, q_.data() + first, residual_.data() + first, count);
      });
    }
    if (task.sheet) {
      kernels_.sheet_apply(sheet, inertia, matrix, z.data(), q.data(), carry_[static_cast<std::size_t>(worker)].data(),
                           task.first, task.end);
    } else {
      kernels_.organ_apply(organ, organ_matrix, inertia, z_.data(), q_.data(), Vertex(task.first), Vertex(task.end));
    }
    AddElements(task, &q_);
    ForParts(task, [&](std::size_t first, std::size_t count) {
      kernels_.add(-last.alpha, q_.data() + first, residual_.data() + first, count);
    });
  });
  elements_.AddContactProduct(z_.data(), -last.alpha, residual_.data());
}

/// Where Solve is to leave the residual: where it is somebody's force, or steepest descent goes on from it.
void ImplicitSolver::WantResidual(std::span<const std::uint8_t> regions) {
  if (std::equal(regions.begin(), regions.end(), wanted_.marked.begin())) {
    return;
  }
  std::copy(regions.begin(), regions.end(), wanted_.marked.begin());
  regions_.FindTasks(&wanted_);
}

void ImplicitSolver::AddElements(const Task& task, FloatArray* field) const {
  ForRegions(task, [&](int region, int, int) { elements_.AddInRegion(region, field->data()); });
}

/// Preconditioned conjugate gradients from d = 0; the residual is then that of place + d where it is wanted.
///
/// Of the last direction z + beta p no more is needed than the curvature along it, and it is never stored: p and it are
/// conjugate, so its curvature is that of z less beta^2 times that of p. Nor is the step along p before it: both are
/// made at once.
void ImplicitSolver::Solve(float inertia, int iterations) {
  const Sheet sheet = MakeSheet();
  const Middle middle = coarse_.middle();
  const float* const r[3] = {residual_.data() + tube_floats_, residual_.data() + tube_floats_ + plane_,
                             residual_.data() + tube_floats_ + 2 * plane_};
  const auto restrict_rows = [&](const Task& task) {
    if (task.sheet) {
      kernels_.sheet_restrict(sheet, middle, r, row_sums_.data(), task.first, task.end);
    }
  };
  ForTasks([&](const Task& task, int, int) {
    if (forces_due_) {
      AddElements(task, &residual_);
    }
    restrict_rows(task);
  });
  forces_due_ = false;
  double rz = Precondition(), curvature = 0;
  Step step;
  for (int i = 0; i + 1 < iterations; ++i) {
    const bool last_but_one = i + 2 == iterations;
    FloatArray& direction = i == 0 ? z_ : p_;
    curvature = Apply(direction, inertia);
    // Nothing left to solve, or not finite: Finish counts what is not.
    if (!(rz > 0.0) || !(curvature > 0.0)) {
      LastStep({}, i > 0, inertia);
      return;
    }
    const auto alpha = static_cast<float>(rz / curvature);
    ForTasks([&](const Task& task, int, int) {
      AddElements(task, &q_);
      ForParts(task, [&](std::size_t first, std::size_t count) {
        float *q = q_.data() + first, *residual = residual_.data() + first, *d = d_.data() + first;
        if (last_but_one) {
          kernels_.add(-alpha, q, residual, count);
        } else if (i == 0) {
          kernels_.start(alpha, direction.data() + first, q, d, residual, count);
        } else {
          kernels_.advance(alpha, direction.data() + first, q, d, residual, count);
        }
      });
      restrict_rows(task);
    });
    if (i == 0) {
      std::swap(z_, p_);
    }
    const double next = Precondition();
    step.beta = static_cast<float>(next / rz);
    rz = next;
    if (last_but_one) {
      step.of_before = alpha;
      break;
    }
    ForTasks([&](const Task& task, int, int) {
      ForParts(task, [&](std::size_t first, std::size_t count) {
        kernels_.combine(z_.data() + first, step.beta, p_.data() + first, count);
      });
    });
  }
  const auto beta = static_cast<double>(step.beta);
  curvature = Curvature(z_, inertia) - beta * beta * curvature;
  if (rz > 0.0 && curvature > 0.0) {
    step.alpha = static_cast<float>(rz / curvature);
    step.of_before += step.alpha * step.beta;
  }
  LastStep(step, iterations > 2, inertia);
}

/// One step of steepest descent with the blocks of the diagonal, where stiff contacts press: with two iterations alone
/// a pressed patch chatters. A third everywhere would do as well, at ten times the cost.
void ImplicitSolver::SolveAtContacts(float inertia) {
  const Sheet sheet = MakeSheet();
  const SheetMatrix matrix = MakeMatrix();
  const OrganMatrix organ_matrix = MakeOrganMatrix();
  const float* const r[3] = {residual_.data() + tube_floats_, residual_.data() + tube_floats_ + plane_,
                             residual_.data() + tube_floats_ + 2 * plane_};
  float* const z[3] = {local_.data() + tube_floats_, local_.data() + tube_floats_ + plane_,
                       local_.data() + tube_floats_ + 2 * plane_};
  const float* const d[3] = {d_.data() + tube_floats_, d_.data() + tube_floats_ + plane_,
                             d_.data() + tube_floats_ + 2 * plane_};
  ForTasks(pressed_, [&](const Task& task, int index, int) {
    partial_[static_cast<std::size_t>(index)] =
        task.sheet ? kernels_.sheet_block_solve(sheet, matrix, r, z, task.first, task.end)
                   : kernels_.organ_block_solve(organ_matrix, residual_.data(), local_.data(), Vertex(task.first),
                                                Vertex(task.end));
  });
  const double rz = SumOfPartials(pressed_.tasks.size());
  const double curvature = Apply(local_, inertia, around_, around_elements_);
  elements_.Add(around_elements_, q_.data());
  if (!(rz > 0.0) || !(curvature > 0.0)) {
    return;
  }
  const auto alpha = static_cast<float>(rz / curvature);
  ForTasks(around_, [&](const Task& task, int, int) {
    ForParts(task, [&](std::size_t first, std::size_t count) {
      kernels_.advance(alpha, local_.data() + first, q_.data() + first, d_.data() + first, residual_.data() + first,
                       count);
    });
    ForRegions(task, [&](int region, int first, int end) {
      largest_sq_[static_cast<std::size_t>(region)] =
          task.sheet ? kernels_.sheet_largest(sheet, d, first, end)
                     : kernels_.organ_largest(d_.data(), Vertex(first), Vertex(end));
    });
  });
}

float ImplicitSolver::LargestCorrection() const {
  return std::sqrt(*std::max_element(largest_sq_.begin(), largest_sq_.end()));
}

void ImplicitSolver::LimitCorrection(float largest) {
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

/// Halves the correction until the energy is no larger than without it.
void ImplicitSolver::SearchAlongCorrection(const Inertia& inertia, std::span<const ContactRow> contacts) {
  const double before = EnergyAt(place_, inertia, contacts);
  for (int halving = 0; halving <= kHalvings; ++halving) {
    ForTasks([&](const Task& task, int, int) {
      ForParts(task, [&](std::size_t first, std::size_t floats) {
        for (std::size_t i = first; i < first + floats; ++i) {
          q_[i] = place_[i] + d_[i];
        }
      });
    });
    if (EnergyAt(q_, inertia, contacts) <= before || halving == kHalvings) {
      break;
    }
    for (std::size_t i = 0; i < tube_floats_ + 3 * plane_; ++i) {
      d_[i] *= 0.5f;
    }
  }
}

}  // namespace fulcrum::physics::implicit
