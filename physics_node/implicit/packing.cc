// The solver's memory: how the arrays of ImplicitModel are made of an ElasticModel, what state and scratch allocate,
// and the views of them that kernels get.
#include <algorithm>
#include <utility>

#include "physics_node/implicit/elements.h"
#include "physics_node/implicit/implicit_model.h"
#include "physics_node/implicit/implicit_state.h"
#include "services/base/core/sheets.h"
#include "services/base/core/solids.h"

namespace fulcrum::physics::implicit {
namespace {

/// Memory is reserved for so many entries of the diagonal that contacts raise, and for so many particles of a query;
/// with more the lists grow.
constexpr std::size_t kReservedRaised = 4 * Elements::kReservedContacts, kReservedQueried = 256;

/// Pairs of particles that patches and bindings join.
std::vector<std::pair<ParticleRef, ParticleRef>> JoinedParticles(const ElasticModel& model,
                                                                 const ParticleStore& particles) {
  std::vector<std::pair<ParticleRef, ParticleRef>> joined;
  for (const ElasticPatch& patch : model.patches) {
    for (Index i = patch.first_link; i < patch.first_link + patch.link_count; ++i) {
      joined.emplace_back(particles.Ref(patch.vertex), particles.Ref(model.patch_links[i].v));
    }
  }
  for (const ElasticBinding& binding : model.bindings) {
    for (const Index v : binding.surface) {
      joined.emplace_back(particles.Ref(binding.membrane), particles.Ref(v));
    }
  }
  for (const ElasticHinge& attachment : model.attachments) {
    for (std::size_t i = 1; i < attachment.v.size(); ++i) {
      joined.emplace_back(particles.Ref(attachment.v[0]), particles.Ref(attachment.v[i]));
    }
  }
  return joined;
}

std::vector<Index> BodyOfRows(const TissueScene& scene) {
  const std::vector<Index> body = BodyOfSheets(scene);
  std::vector<Index> of;
  for (const std::size_t sheet : SheetOfRows(scene)) of.push_back(body[sheet]);
  return of;
}

}  // namespace

static_assert(kLeastSheetDeterminant == static_cast<float>(kLeastDeterminant));

SheetModel::SheetModel(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles)
    : continuum(!model.triangles.empty()),
      mass(particles.layout().plane()),
      stiffening(static_cast<float>(model.spring_stiffening())),
      triangle_stiffening(static_cast<float>(model.triangle_stiffening())),
      rest_scale(1.0f / (1.0f + scene.physics.membrane_prestrain)) {
  for (const SheetProperties& of_row : PropertiesOfRows(scene)) Et.push_back(of_row.Et_N_per_m);
  const GridLayout& layout = particles.layout();
  for (std::size_t d = 0; d < 3; ++d) {
    inverse_rest[d] = FloatArray(layout.plane());
    axial[d] = FloatArray(layout.plane());
  }
  for (std::uint32_t row = 0; row < layout.rows; ++row) {
    for (std::uint32_t col = 0; col < layout.cols; ++col) {
      const std::uint32_t node = row * layout.cols + col, at = layout.Offset(row, col);
      mass[at] = static_cast<float>(model.mass[particles.tube_count() + node]);
      for (std::size_t d = 0; d < 3; ++d) {
        const ElasticSpring& spring = model.springs[3 * node + d];
        axial[d][at] = static_cast<float>(spring.axial);
        inverse_rest[d][at] = spring.axial > 0 ? static_cast<float>(1.0 / spring.rest_length) : 1.0f;
      }
    }
  }
}

OrganModel::OrganModel(const ElasticModel& model, std::uint32_t vertices)
    : start(vertices + 1, 0),
      patch_start(vertices + 1, 0),
      volume(vertices + kPatchGroup),
      shear(vertices + kPatchGroup),
      mass(vertices + kPatchGroup),
      mu(static_cast<float>(model.mu_Pa)),
      lambda(static_cast<float>(model.lambda_Pa + model.mu_Pa)) {
  for (const ElasticPatch& of_vertex : model.patches) {
    volume[of_vertex.vertex] = static_cast<float>(of_vertex.volume);
    shear[of_vertex.vertex] = static_cast<float>((1 - of_vertex.variance) * model.mu_Pa);
    start[of_vertex.vertex + 1] = of_vertex.link_count;
  }
  for (const ElasticPatchLink& link : model.patch_links) {
    ++patch_start[link.v + 1];
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    mass[v] = static_cast<float>(model.mass[v]);
    start[v + 1] += start[v];
    patch_start[v + 1] += patch_start[v];
  }
  const std::size_t links = model.patch_links.size();
  vertex.resize(links);
  patch.resize(links);
  gradient = FloatArray(kVertexFloats * links);
  patch_gradient = FloatArray(kVertexFloats * links);
  std::vector<std::uint32_t> next(patch_start.begin(), patch_start.end());
  for (const ElasticPatch& of_vertex : model.patches) {
    for (Index i = 0; i < of_vertex.link_count; ++i) {
      const ElasticPatchLink& link = model.patch_links[of_vertex.first_link + i];
      const std::uint32_t to = start[of_vertex.vertex] + i, back = next[link.v]++;
      vertex[to] = link.v;
      patch[back] = of_vertex.vertex;
      for (int axis = 0; axis < 3; ++axis) {
        const auto g = static_cast<float>(link.gradient[axis]);
        gradient[kVertexFloats * to + static_cast<std::size_t>(axis)] = g;
        patch_gradient[kVertexFloats * back + static_cast<std::size_t>(axis)] = g;
      }
    }
  }
  const auto edge = [&](Index from, Index to) -> float& {
    for (std::uint32_t i = patch_start[from];; ++i) {
      if (patch[i] == to) {
        return patch_gradient[kVertexFloats * i + 3];
      }
    }
  };
  for (const ElasticShearLink& link : model.shear_links) {
    const auto k = static_cast<float>(link.stiffness);
    edge(link.a, link.b) = k;
    edge(link.b, link.a) = k;
  }
  // The same by patch: the curvature then gathers nothing by vertex.
  next.assign(patch_start.begin(), patch_start.end());
  for (const ElasticPatch& of_vertex : model.patches) {
    for (Index i = 0; i < of_vertex.link_count; ++i) {
      const std::uint32_t back = next[model.patch_links[of_vertex.first_link + i].v]++;
      gradient[kVertexFloats * (start[of_vertex.vertex] + i) + 3] = patch_gradient[kVertexFloats * back + 3];
    }
  }
}

Organ OrganModel::View() const {
  return {static_cast<std::uint32_t>(start.size() - 1),
          start.data(),
          vertex.data(),
          gradient.data(),
          patch_start.data(),
          patch.data(),
          patch_gradient.data(),
          volume.data(),
          shear.data(),
          mu,
          lambda,
          mass.data()};
}

ImplicitModel::ImplicitModel(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles)
    : layout(particles),
      grid(particles.layout()),
      partition(particles, JoinedParticles(model, particles), SolidOfVertices(scene), BodyOfRows(scene)),
      sheet(scene, model, particles),
      organ(model, particles.tube_count()),
      load(layout.floats),
      element_diagonal(layout.scalar_count()),
      damping_per_s(static_cast<float>(model.damping_per_s)),
      gravity(model.gravity.cast<float>()) {
  for (Index p = 0; p < model.load.size(); ++p) {
    PutField(load.data(), particles.Ref(p), model.load[p].cast<float>());
  }
  for (const auto& [base, stiffness] : Elements::Diagonal(model, particles)) {
    element_diagonal[layout.ScalarIndex({base})] += stiffness;
  }
}

Inertia ImplicitModel::InertiaOf(float h) const {
  return {h, (1.0f + damping_per_s * h) / (h * h), {gravity.x(), gravity.y(), gravity.z()}};
}

Linearisation::Linearisation(const ImplicitModel& model)
    : point(model.layout.floats), residual(model.layout.floats), element_diagonal(model.layout.scalar_count()) {
  const FieldLayout& layout = model.layout;
  for (std::size_t d = 0; d < 3; ++d) {
    kt[d] = FloatArray(layout.plane);
    along[d] = FloatArray(layout.plane);
    for (std::size_t half = 0; half < 2 && model.sheet.continuum; ++half) {
      coupling[half][d] = FloatArray(layout.plane);
    }
  }
  for (FloatArray& block : sheet_blocks) {
    block = FloatArray(layout.plane);
  }
  for (FloatArray* a : {&organ_c, &organ_f, &organ_blocks}) {
    *a = FloatArray(kMatrixFloats * (layout.tube_count + kPatchGroup));
  }
  std::copy_n(model.element_diagonal.data(), element_diagonal.size(), element_diagonal.data());
  raised.reserve(kReservedRaised);
}

ContactZone::ContactZone(const ImplicitModel& model, const Elements& all_elements)
    : pressed(static_cast<std::size_t>(model.partition.count()), 0),
      inner(model.partition.MakeSet()),
      outer(model.partition.MakeSet()),
      elements(all_elements.MakeSelection()),
      direction(model.layout.floats) {}

TouchedRegions::TouchedRegions(const ImplicitModel& model)
    : held(static_cast<std::size_t>(model.partition.count()), 0), touched(held) {}

Movement::Movement(const ParticleStore& particles)
    : of_step(particles.block_count(), 0.0f), before_sleep(particles.block_count(), 0.0f) {}

SolverState::SolverState(const TissueScene& scene, const ElasticModel& elastic, const TissueModel& tissue,
                         const SolverContext& context)
    : velocity(context.model.layout.floats),
      edges(context.model, tissue),
      elements(scene, elastic, context.particles, context.model.partition),
      regions(context.model.partition),
      coarse(scene, elastic, context.particles, context.kernels),
      linearisation(context.model),
      contact_zone(context.model, elements),
      touched(context.model),
      movement(context.particles) {
  organ_blocks.urgent.assign(static_cast<std::size_t>(context.model.partition.count()), 0);
  for (FloatArray& displacement : query_displacement) {
    displacement = FloatArray(context.model.layout.floats);
  }
  elements.UpdateTopology(tissue);
  coarse.ScaleHats(edges.View(context.particles.plane(3)));
}

KrylovVectors::KrylovVectors(const FieldLayout& layout)
    : z(layout.floats), p(layout.floats), q(layout.floats), d(layout.floats) {}

SolverScratch::SolverScratch(const SolverContext& context, std::size_t hat_row_floats)
    : krylov(context.model.layout),
      kept_residual(context.model.layout.floats),
      organ_stress(kStressFloats * (context.model.layout.tube_count + std::size_t{1})),
      row_sums(static_cast<std::size_t>(context.model.layout.rows) * hat_row_floats),
      touched(context.model),
      residual_regions(context.model.partition.MakeSet()) {
  for (int worker = 0; worker < context.workers.count(); ++worker) {
    carry.emplace_back(kCarryPlanes * context.model.layout.stride + kCacheLineFloats);
  }
  const auto regions = static_cast<std::size_t>(context.model.partition.count());
  partial_sums.assign(regions, 0.0);
  predicted.assign(regions, {});
  finished.assign(regions, {});
  speed.assign(regions, 0.0f);
  correction_sq.assign(regions, 0.0f);
  wanted.assign(regions, 0);
  queried.reserve(kReservedQueried);
}

LinearSystem::LinearSystem(const SolverContext& context, float mass_factor, SolverState* state, SolverScratch* scratch)
    : sheet(state->edges.View(context.particles.plane(3))),
      organ(context.model.organ.View()),
      hats(state->coarse.hats()),
      inertia(mass_factor) {
  Linearisation& at = state->linearisation;
  const auto point = context.model.layout.Planes(std::as_const(at.point));
  for (std::size_t d = 0; d < 3; ++d) {
    sheet_matrix.kt[d] = at.kt[d].data();
    sheet_matrix.along[d] = at.along[d].data();
    for (std::size_t half = 0; half < 2; ++half) {
      sheet_matrix.coupling[half][d] = at.coupling[half][d].data();
    }
    sheet_matrix.point[d] = point[d];
  }
  for (std::size_t i = 0; i < at.sheet_blocks.size(); ++i) {
    sheet_matrix.block[i] = at.sheet_blocks[i].data();
  }
  organ_matrix = {at.organ_c.data(), at.organ_f.data(), scratch->organ_stress.data(), at.organ_blocks.data()};
}

SheetFields SheetFieldsAt(const SolverContext& context, const SolverState& state, const FloatArray& point,
                          FloatArray* residual) {
  const FieldLayout& layout = context.model.layout;
  SheetFields fields;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t plane = layout.tube_floats + axis * layout.plane;
    fields.point[axis] = point.data() + plane;
    fields.start[axis] = context.particles.plane(static_cast<int>(axis));
    fields.velocity[axis] = state.velocity.data() + plane;
    fields.load[axis] = context.model.load.data() + plane;
    fields.residual[axis] = residual ? residual->data() + plane : nullptr;
  }
  fields.element_diagonal = state.linearisation.element_diagonal.data();
  return fields;
}

OrganFields OrganFieldsAt(const SolverContext& context, const SolverState& state, const FloatArray& point,
                          FloatArray* residual) {
  return {point.data(), context.particles.tube(), state.velocity.data(), context.model.load.data(),
          residual ? residual->data() : nullptr};
}

}  // namespace fulcrum::physics::implicit
