#include "physics_node/implicit/substep.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics_node/implicit/phases.h"

namespace fulcrum::physics::implicit {
namespace {

/// Speed limit of the prediction [m/s], and over that of the fastest tool: what a tool pulls follows it; what snaps
/// back or flaps beside a cut does not carry the error of one truncated solve into the next. Where a velocity exceeds
/// the first, however fast the tools are, the prediction is compared in energy with the present position: a tool does
/// not pull all that moves (deploy/docs/measurements/physics, Prediction).
constexpr float kPredictedSpeed_m_s = 0.08f, kOverFastestTool = 1.5f;
/// No particle is faster [m/s]: ten times a quick hand.
constexpr float kLargestSpeed_m_s = 5.0f;
/// Steps in which each region of the organ gets new diagonal blocks once: without contact the organ does not turn
/// enough meanwhile to matter.
constexpr std::uint32_t kOrganBlockPeriod = 2;
/// OrganBlockSchedule::urgent: renew in this substep and in the next one, which then has the blocks without the
/// contact.
constexpr std::uint8_t kUrgentTwice = 2;

// Prediction.

/// How far a particle may be predicted from its position [m].
float PredictionLimit(const ParticleStore& particles, float h, const BoundaryConditions& boundary) {
  float farthest_sq = 0;
  for (const HeldPlace& held : boundary.held) {
    farthest_sq = std::max(farthest_sq, (held.place - particles.At(held.at)).squaredNorm());
  }
  for (const ContactRow& row : boundary.contacts) {
    farthest_sq = std::max(farthest_sq, row.drift.squaredNorm());
  }
  return std::max(kPredictedSpeed_m_s * h, kOverFastestTool * std::sqrt(farthest_sq));
}

/// point <- start + h velocity, at most `limit` away [m]; what has no finite velocity stays.
PredictionCount PredictByVelocity(const SolverContext& context, float h, float limit, SolverState* state,
                                  SolverScratch* scratch) {
  const FieldLayout& layout = context.model.layout;
  const Sheet sheet = state->edges.View(context.particles.plane(3));
  const float* const start[3] = {context.particles.plane(0), context.particles.plane(1), context.particles.plane(2)};
  const auto velocity = layout.Planes(std::as_const(state->velocity));
  FloatArray& point = state->linearisation.point;
  const auto planes = layout.Planes(&point);
  const RegionSet& computed = state->regions.computed();
  ForTasks(&context.workers, computed, [&](const Task& task, int index, int) {
    scratch->predicted[static_cast<std::size_t>(index)] =
        task.sheet ? context.kernels.sheet.predict(sheet, h, limit, start, velocity.data(), planes.data(), task.first,
                                                   task.end)
                   : context.kernels.organ.predict(h, limit, context.particles.tube(), state->velocity.data(),
                                                   point.data(), Vertex(task.first), Vertex(task.end));
  });
  PredictionCount count{};
  for (std::size_t i = 0; i < computed.tasks.size(); ++i) {
    count.largest_sq = std::max(count.largest_sq, scratch->predicted[i].largest_sq);
    count.resets += scratch->predicted[i].resets;
  }
  return count;
}

void ResetDamagedVelocities(FloatArray* velocity) {
  for (std::size_t i = 0; i < velocity->size(); ++i) {
    (*velocity)[i] = std::isfinite((*velocity)[i]) ? (*velocity)[i] : 0.0f;
  }
}

/// Particles whose velocity is no prediction: held ones, those that a tool presses, along its normal, and frayed ones.
/// Predicted from its velocity, pressed tissue would bounce: the error of one solve, taken for velocity, doubles in the
/// next prediction. Shreds that hang on little are light and turn far in a substep, and a few iterations cannot solve
/// each of many.
void PredictConstrained(const SolverContext& context, const BoundaryConditions& boundary, SolverState* state) {
  const ParticleStore& particles = context.particles;
  float* const point = state->linearisation.point.data();
  for (const ParticleRef at : state->edges.frayed_nodes()) {
    PutField(point, at, particles.At(at));
  }
  for (const ContactRow& row : boundary.contacts) {
    if (!(Elements::ContactStiffness(row) > Elements::kStiffContact_N_per_m)) {
      continue;
    }
    const float inside = row.offset - row.normal.dot(row.At(context.particles.pool()));
    if (!(inside > 0.0f)) {
      continue;
    }
    // With the tool, but no farther than to its surface.
    const float along = std::min(row.normal.dot(row.drift), inside);
    for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k) {
      const Vec3f place = FieldAt(point, row.at[k]), moved = place - particles.At(row.at[k]);
      if (particles.InverseMass(row.at[k]) > 0.0f) {
        PutField(point, row.at[k], place + row.normal * (along - row.normal.dot(moved)));
      }
    }
  }
  for (const HeldPlace& held : boundary.held) {
    PutField(point, held.at, held.place);
  }
}

// Linearisation.

/// Contacts, slides, clips, folds and frayed edges stiffen the diagonal of what they touch.
void UpdateElementDiagonal(const ImplicitModel& model, SolverState* state) {
  Linearisation& at = state->linearisation;
  for (const std::size_t i : at.raised) {
    at.element_diagonal[i] = model.element_diagonal[i];
  }
  at.raised.clear();
  const auto raise = [&](std::size_t i, float stiffness) {
    at.element_diagonal[i] += stiffness;
    at.raised.push_back(i);
  };
  const auto renew_blocks = [&](ParticleRef particle) {
    state->organ_blocks.urgent[static_cast<std::size_t>(model.partition.Of(particle))] = kUrgentTwice;
  };
  // Blocks of the organ that only soft contacts or slides touch are renewed when their region is due.
  const auto raise_all = [&](const Element& e, bool renews) {
    const float stiffness = e.kt + e.m.squaredNorm();
    for (std::size_t k = 0; k < static_cast<std::size_t>(e.count); ++k) {
      raise(model.layout.ScalarIndex(e.at[k]), stiffness * e.weight[k] * e.weight[k]);
      if (renews) renew_blocks(e.at[k]);
    }
  };
  for (const Element& contact : state->elements.contacts()) raise_all(contact, Elements::IsStiff(contact));
  for (const Element& slide : state->elements.slides().elements()) raise_all(slide, false);
  if (state->elements.has_clips()) {
    // K of a clip is not above k I.
    state->elements.clips().ForEach([&](std::span<const ParticleRef> clipped) {
      for (const ParticleRef of : clipped) raise(model.layout.ScalarIndex(of), Clips::kStiffness_N_per_m);
    });
  }
  for (const FrayedEdge& edge : state->edges.frayed_edges()) {
    for (const std::uint32_t i : edge.at) {
      raise(i, edge.stiffness);
    }
  }
  state->elements.guard().ForDiagonal([&](Index vertex, float stiffness) {
    const ParticleRef particle{4 * vertex};
    raise(model.layout.ScalarIndex(particle), stiffness);
    renew_blocks(particle);
  });
}

/// First phase: edges and patches. Stresses act on the vertices around, so the residual of the organ needs a second
/// one.
void LineariseEdgesAndPatches(const SolverContext& context, const Inertia& inertia, const LinearSystem& system,
                              SolverState* state, SolverScratch* scratch) {
  const float* const point = state->linearisation.point.data();
  const SheetFields fields = SheetFieldsAt(context, *state, state->linearisation.point, &state->linearisation.residual);
  const RegionSet& computed = state->regions.computed();
  const auto sheet_tasks = static_cast<std::size_t>(computed.sheet_tasks);
  ForTasksBeside(
      &context.workers, computed.sheet_tasks, static_cast<int>(computed.patches.size()),
      [&](int index, int worker) {
        const auto i = static_cast<std::size_t>(index);
        const Task& task = i < sheet_tasks ? computed.tasks[i] : computed.patches[i - sheet_tasks];
        if (task.sheet) {
          const Regions& regions = state->regions;
          const bool above = task.first > 0 && !regions.computed(regions.partition().At(true, task.first - 1));
          context.kernels.sheet.linearise(system.sheet, inertia, fields, system.sheet_matrix,
                                          scratch->carry[static_cast<std::size_t>(worker)].data(), above, task.first,
                                          task.end);
        } else {
          context.kernels.organ.linearise(system.organ, system.organ_matrix, point, Vertex(task.first),
                                          Vertex(task.end));
        }
      },
      [&] { state->elements.LineariseHinges(point); }, [&] { state->elements.LineariseBindings(point); });
}

/// A node that hangs on few edges turns freely: without this only its small mass resists a correction across them.
void StiffenFrayedEdges(const SheetEdges& edges, Linearisation* at) {
  for (const FrayedEdge& edge : edges.frayed_edges()) {
    float& kt = at->kt[edge.direction][edge.at[0]];
    kt = std::max(kt, edge.stiffness);
  }
}

/// Second phase: residual and diagonal blocks of the organ, hats, and beside them the next part of the coarse matrix.
void LineariseVerticesAndLevels(const SolverContext& context, const Inertia& inertia, const LinearSystem& system,
                                SolverState* state) {
  OrganBlockSchedule& blocks = state->organ_blocks;
  const bool all_due = inertia.inertia != blocks.inertia, step_due = blocks.step_due;
  blocks.inertia = inertia.inertia;
  blocks.step_due = false;
  const OrganFields fields = OrganFieldsAt(context, *state, state->linearisation.point, &state->linearisation.residual);
  const float* const diagonal = state->linearisation.element_diagonal.data() + context.model.layout.plane;
  const auto body = [&](const Task& task, int, int) {
    if (task.sheet) {
      const auto [first, end] = state->coarse.HatRows(task.first, task.end);
      context.kernels.sheet.hat_blocks(system.sheet, system.hats, system.sheet_matrix, inertia.inertia, first, end);
      return;
    }
    context.kernels.organ.residual(system.organ, system.organ_matrix, inertia, fields, Vertex(task.first),
                                   Vertex(task.end));
    ForRegions(context.model.partition, task, [&](int region, int first, int end) {
      std::uint8_t& urgent = blocks.urgent[static_cast<std::size_t>(region)];
      const bool due = step_due && (static_cast<std::uint32_t>(region) + state->steps) % kOrganBlockPeriod == 0;
      if (all_due || due || urgent != 0) {
        context.kernels.organ.blocks(system.organ, system.organ_matrix, context.particles.tube(), diagonal,
                                     inertia.inertia, Vertex(first), Vertex(end));
      }
      urgent = static_cast<std::uint8_t>(urgent >> 1);
    });
  };
  ForTasksAndSideTask(&context.workers, state->regions.computed(), body, [&] {
    if (state->coarse_due && state->coarse.FollowsComputed(state->regions, state->elements.slides())) {
      state->coarse.AssembleNextPart(system.sheet, system.sheet_matrix, inertia.inertia, state->elements.slides());
      state->coarse_due = false;
    }
  });
}

void AddContactsToLevels(const Elements& elements, CoarseSpace* coarse) {
  coarse->ExcludeSolids(elements.guard().folded());
  coarse->ClearContacts();
  for (const Element& contact : elements.contacts()) {
    if (Elements::IsStiff(contact)) {
      coarse->AddContact(contact);
    }
  }
  if (elements.has_clips()) {
    elements.clips().ForEach(
        [&](std::span<const ParticleRef> clipped) { coarse->AddClip(clipped, Clips::kStiffness_N_per_m); });
  }
  coarse->FadeAtContacts();
}

/// Finds the regions that stiff contacts press, and those that resist there.
void UpdateContactZone(const SolverContext& context, SolverState* state) {
  const Partition& partition = context.model.partition;
  const Regions& regions = state->regions;
  ContactZone& zone = state->contact_zone;
  zone.active = false;
  std::fill(zone.pressed.begin(), zone.pressed.end(), std::uint8_t{0});
  for (const Element& contact : state->elements.contacts()) {
    for (std::size_t k = 0; Elements::IsStiff(contact) && k < static_cast<std::size_t>(contact.count); ++k) {
      const int region = partition.Of(contact.at[k]);
      zone.pressed[static_cast<std::size_t>(region)] = regions.computed(region) ? 1 : 0;
      zone.active = true;
    }
  }
  if (!zone.active || (!zone.outdated && zone.pressed == zone.inner.marked)) {
    return;
  }
  zone.outdated = false;
  for (const Task& task : zone.inner.tasks) {
    ForPieces(context.model.layout, task,
              [&](std::size_t first, std::size_t count) { std::fill_n(zone.direction.data() + first, count, 0.0f); });
  }
  zone.inner.marked = zone.pressed;
  partition.FindTasks(&zone.inner);
  zone.outer.marked = zone.pressed;
  regions.Widen(&zone.outer);
  partition.FindTasks(&zone.outer);
  state->elements.Select(partition, zone.inner.marked, zone.outer.marked, &zone.elements);
}

}  // namespace

double EnergyAt(const SolverContext& context, const FloatArray& point, const Inertia& inertia,
                std::span<const ContactRow> contacts, SolverState* state, SolverScratch* scratch) {
  const Sheet sheet = state->edges.View(context.particles.plane(3));
  const Organ organ = context.model.organ.View();
  const SheetFields sheet_fields = SheetFieldsAt(context, *state, point, nullptr);
  const OrganFields organ_fields = OrganFieldsAt(context, *state, point, nullptr);
  const RegionSet& computed = state->regions.computed();
  double of_hinges = 0, of_bindings = 0;
  ForTasksBeside(
      &context.workers, computed.sheet_tasks, static_cast<int>(computed.tasks.size()) - computed.sheet_tasks,
      [&](int index, int) {
        const auto i = static_cast<std::size_t>(index);
        const Task& task = computed.tasks[i];
        scratch->partial_sums[i] =
            task.sheet
                ? context.kernels.sheet.energy(sheet, inertia, sheet_fields, task.first, task.end)
                : context.kernels.organ.energy(organ, inertia, organ_fields, Vertex(task.first), Vertex(task.end));
      },
      [&] { of_hinges = state->elements.EnergyOfHinges(point.data()); },
      [&] { of_bindings = state->elements.EnergyOfBindingsAndContacts(point.data(), contacts); });
  return SumInOrder(scratch->partial_sums, computed.tasks.size()) + (of_hinges + of_bindings);
}

void PredictAtRest(const SolverContext& context, SolverState* state, SolverScratch* scratch) {
  (void)PredictByVelocity(context, 0.0f, 0.0f, state, scratch);
}

std::uint32_t Predict(const SolverContext& context, const Inertia& inertia, const BoundaryConditions& boundary,
                      SolverState* state, SolverScratch* scratch) {
  const float limit = PredictionLimit(context.particles, inertia.h, boundary);
  const PredictionCount count = PredictByVelocity(context, inertia.h, limit, state, scratch);
  if (count.resets > 0) {
    ResetDamagedVelocities(&state->velocity);
  }
  PredictConstrained(context, boundary, state);
  // A fast prediction may have more energy than the present positions: beside nodes that are predicted in place it
  // stretches edges, and the limited correction would not undo that. The better of both is taken.
  const float doubtful = kPredictedSpeed_m_s * inertia.h;
  if (count.largest_sq > doubtful * doubtful) {
    const auto energy = [&] {
      return EnergyAt(context, state->linearisation.point, inertia, boundary.contacts, state, scratch);
    };
    const double moving = energy();
    PredictAtRest(context, state, scratch);
    PredictConstrained(context, boundary, state);
    if (moving < energy()) {
      (void)PredictByVelocity(context, inertia.h, limit, state, scratch);
      PredictConstrained(context, boundary, state);
    }
  }
  return count.resets;
}

void Linearise(const SolverContext& context, const Inertia& inertia, std::span<const ContactRow> contacts,
               SolverState* state, SolverScratch* scratch) {
  Linearisation& at = state->linearisation;
  const bool slides = !state->elements.slides().empty(), clips = state->elements.has_clips();
  context.workers.Run(slides || clips ? 3 : 2, 0, [&](int task, int) {
    if (task == 0) {
      state->elements.FindContacts(inertia.h, at.point.data(), context.particles.pool(), state->regions, contacts);
    } else if (task == 1) {
      state->elements.FindInversions(at.point.data(), state->regions);
    } else {
      state->elements.FindSlides(at.point.data(), state->regions);
      if (clips) state->elements.FitClips(at.point.data(), state->regions);
    }
  });
  UpdateElementDiagonal(context.model, state);
  const LinearSystem system(context, inertia.inertia, state, scratch);
  LineariseEdgesAndPatches(context, inertia, system, state, scratch);
  StiffenFrayedEdges(state->edges, &at);
  LineariseVerticesAndLevels(context, inertia, system, state);
  AddContactsToLevels(state->elements, &state->coarse);
  UpdateContactZone(context, state);
  state->elements.AddContactForces(at.residual.data());
  at.lacks_element_forces = true;
}

SubstepReport Finish(const SolverContext& context, float h, SolverState* state, SolverScratch* scratch) {
  const FieldLayout& layout = context.model.layout;
  const Kernels& kernels = context.kernels;
  ParticleStore& particles = context.particles;
  const Sheet sheet = state->edges.View(particles.plane(3));
  const FloatArray &point = state->linearisation.point, &d = scratch->krylov.d;
  const auto point_planes = layout.Planes(point), d_planes = layout.Planes(d);
  const auto velocity = layout.Planes(&state->velocity);
  float* const x[3] = {particles.plane(0), particles.plane(1), particles.plane(2)};
  const RegionSet& computed = state->regions.computed();
  std::fill(scratch->speed.begin(), scratch->speed.end(), 0.0f);
  ForTasks(&context.workers, computed, [&](const Task& task, int index, int) {
    FinishCount& total = scratch->finished[static_cast<std::size_t>(index)] = {};
    ForRegions(context.model.partition, task, [&](int region, int first, int end) {
      const FinishCount count =
          task.sheet ? kernels.sheet.finish(sheet, point_planes.data(), d_planes.data(), h, kLargestSpeed_m_s, x,
                                            velocity.data(), first, end)
                     : kernels.organ.finish(point.data(), d.data(), h, kLargestSpeed_m_s, particles.pool(),
                                            state->velocity.data(), Vertex(first), Vertex(end));
      scratch->speed[static_cast<std::size_t>(region)] = std::sqrt(count.largest_speed_sq);
      total.largest_speed_sq = std::max(total.largest_speed_sq, count.largest_speed_sq);
      total.resets += count.resets;
    });
  });
  SubstepReport report;
  float largest = 0;
  for (std::size_t i = 0; i < computed.tasks.size(); ++i) {
    largest = std::max(largest, scratch->finished[i].largest_speed_sq);
    report.resets += scratch->finished[i].resets;
  }
  report.largest_speed_m_s = std::sqrt(largest);
  return report;
}

}  // namespace fulcrum::physics::implicit
