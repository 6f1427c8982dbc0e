#include "physics_node/implicit/elements.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/sheet_collision.h"
#include "physics_node/collision/tissue_collision.h"
#include "physics_node/implicit/kernels.h"
#include "physics_node/simd/sse.h"
#include "services/base/core/solids.h"

namespace fulcrum::physics::implicit {
namespace {

/// Normal stiffness of a contact with a tool and of tissue with tissue [N/m]. A tool's is ten times that of an edge of
/// the membrane (some 200 N/m), so tissue yields and the contact hardly does; tissue rests on the fat around it, which
/// is soft. Assumed.
constexpr float kToolStiffness_N_per_m = 2000.0f, kTissueStiffness_N_per_m = 30.0f;
/// Of a vertex of one solid with another solid: it stands for some 25 mm^2, a node of the membrane for one.
constexpr float kSolidStiffness_N_per_m = 400.0f;
/// Of a node of a sheet with a triangle of a sheet: thin tissue without fat between. Assumed.
constexpr float kSheetStiffness_N_per_m = 200.0f;
/// Least movement along a surface that the Coulomb force is divided by [m]: less within a substep counts as sticking.
/// Some hundred times the rounding of a position.
constexpr float kStickDistance_m = 1e-6f;
/// D over F': resistance to movement along the normal within a substep. With 1 what comes in fast does not bounce.
constexpr float kContactDamping = 1.0f;
/// Viscosity against sliding over normal stiffness, at most [s]: 0.6 N s/m at a tool. A time and not a share of the
/// stiffness: with a stiffness per substep, what sticks creeps slowly in long substeps and at once in short ones.
constexpr float kSlideTime_s = 3e-4f;
/// Depth over which the contact of a tool gets stiff: at least kOnsetDepth_m, and kOnsetOverPath times the tool's way
/// in the substep, but at most kMostOnset_m. Contacts that are stiff at once come and go all together: in one substep
/// some are missing from the linearisation, in the next they push back what fell in meanwhile, and the force of a tool
/// that moves along a surface, if only by the rounding of its position, jumps by more than itself.
constexpr float kOnsetDepth_m = 8e-5f, kOnsetOverPath = 3.0f, kMostOnset_m = 1e-3f;
/// Least length of a binding that is divided by [m].
constexpr float kLeastBindingLength_m = 1e-9f;

// A binding joins a node of the membrane, coordinate by coordinate, to three vertices of the organ, a register each.

__m128 Xyz(const Vec3f& v) { return _mm_set_ps(0, v.z(), v.y(), v.x()); }
/// In all lanes, of the first three.
__m128 Dot3(__m128 a, __m128 b) {
  const __m128 p = _mm_mul_ps(a, b);
  return _mm_add_ps(_mm_add_ps(_mm_shuffle_ps(p, p, 0x00), _mm_shuffle_ps(p, p, 0x55)), _mm_shuffle_ps(p, p, 0xaa));
}
__m128 CombineBinding(const Element& e, const float* field) {
  const auto vertex = [&](std::size_t k) {
    return _mm_mul_ps(_mm_set1_ps(e.weight[k]), _mm_load_ps(field + e.at[k].base));
  };
  const float* node = field + e.at[0].base;
  const std::size_t step = e.at[0].step;
  const __m128 at = _mm_mul_ps(_mm_set1_ps(e.weight[0]), _mm_set_ps(0, node[2 * step], node[step], node[0]));
  return _mm_add_ps(_mm_add_ps(at, vertex(1)), _mm_add_ps(vertex(2), vertex(3)));
}
void AddShare(float weight, ParticleRef to, __m128 v, float* field) {
  float* const out = field + to.base;
  const __m128 share = _mm_mul_ps(_mm_set1_ps(weight), v);
  if (to.step == 1) {
    _mm_store_ps(out, _mm_add_ps(_mm_load_ps(out), share));
    return;
  }
  alignas(16) float part[4];
  _mm_store_ps(part, share);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out[axis * to.step] += part[axis];
  }
}
template <class Sum>
bool AnyMarked(const Sum& e, const Partition& partition, std::span<const std::uint8_t> marked) {
  for (int k = 0; k < e.count; ++k) {
    if (marked[static_cast<std::size_t>(partition.Of(e.at[static_cast<std::size_t>(k)]))] != 0) {
      return true;
    }
  }
  return false;
}

/// Of a contact `depth` deep, without damping. F' rises linearly to the full stiffness k over the onset depth o:
///   depth < o:  F = k depth^2 / (2 o),  F' = k depth / o,  E = k depth^3 / (6 o)
///   else:       F = k (depth - o/2),    F' = k,            E = k ((depth - o/2)^2 / 2 + o^2 / 24)
struct Elastic {
  float force;      ///< F [N]
  float stiffness;  ///< F' [N/m]
  float energy;     ///< E [J]
};
Elastic ElasticOf(const ContactRow& row, float depth) {
  const float full = Elements::ContactStiffness(row);
  const float onset =
      Elements::IsTissue(row) ? 0.0f : std::clamp(kOnsetOverPath * row.drift.norm(), kOnsetDepth_m, kMostOnset_m);
  if (depth < onset) {
    const float stiffness = full * depth / onset;
    return {0.5f * stiffness * depth, stiffness, stiffness * depth * depth / 6.0f};
  }
  const float past = depth - 0.5f * onset;
  return {full * past, full, full * (0.5f * past * past + onset * onset / 24.0f)};
}

/// What a contact does to its particles at `here`.
struct ContactState {
  float stiffness, damping;  ///< F', D [N/m]; damping against the movement in this substep.
  /// Normal [N]. Negative while tissue leaves faster than the contact alone would drive it: cut off at 0, the contact
  /// would be missing from the solve that should hold it, and chatter.
  float force;
  float tangential;  ///< t: stiffness against sliding [N/m].
  Vec3f slide;       ///< u_t [m].
};
ContactState StateOf(float h, const ContactRow& row, const Vec3f& here, const float* start) {
  ContactState state{};
  const float gap = row.normal.dot(here) - row.offset;
  if (!(gap < 0.0f)) {
    return state;
  }
  const Elastic elastic = ElasticOf(row, -gap);
  state.stiffness = elastic.stiffness;
  state.damping = kContactDamping * state.stiffness;
  const Vec3f moved = here - Combine(row, start) - row.drift;
  const float approach = row.normal.dot(moved);
  state.force = elastic.force - state.damping * approach;
  // Viscous up to Coulomb's limit for this normal force.
  state.slide = moved - approach * row.normal;
  state.tangential = std::min(kSlideTime_s / h * state.stiffness, row.friction * std::max(state.force, 0.0f) /
                                                                      std::max(state.slide.norm(), kStickDistance_m));
  return state;
}

}  // namespace

float Elements::ContactStiffness(const ContactRow& row) {
  if (!IsTissue(row)) return kToolStiffness_N_per_m;
  if (IsOfSheets(row)) return kSheetStiffness_N_per_m;
  return (row.source & TissueCollision::kSolidSource) != 0 ? kSolidStiffness_N_per_m : kTissueStiffness_N_per_m;
}
bool Elements::IsTissue(const ContactRow& row) { return (row.source & TissueCollision::kSource) != 0; }
bool Elements::IsOfSheets(const ContactRow& row) {
  return IsTissue(row) && (row.source & SheetCollision::kSheetSource) != 0;
}

Elements::Elements(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles,
                   const Partition& partition)
    : hinges_(model, particles), guard_(model, SolidOfVertices(scene)), slides_(model, particles) {
  for (const ElasticBinding& binding : model.bindings) {
    Element e;
    e.at[0] = particles.Ref(binding.membrane);
    e.weight[0] = 1.0f;
    for (std::size_t i = 0; i < 3; ++i) {
      e.at[i + 1] = particles.Ref(binding.surface[i]);
      e.weight[i + 1] = -static_cast<float>(binding.barycentric[i]);
    }
    bindings_.push_back(e);
    binding_rest_.push_back({static_cast<float>(binding.rest_length),
                             static_cast<float>(binding.stiffness),
                             binding.membrane - scene.membrane.first,
                             {}});
  }
  for (const ElasticHinge& attachment : model.attachments) {
    Element& e = bindings_.emplace_back();
    BindingRest& rest =
        binding_rest_.emplace_back(BindingRest{0.0f, static_cast<float>(attachment.stiffness), kNoIndex, {}});
    Vec3d offset = Vec3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      e.at[i] = particles.Ref(attachment.v[i]);
      e.weight[i] = static_cast<float>(attachment.c[i]);
      offset += attachment.c[i] * model.rest_position[attachment.v[i]];
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      rest.offset[axis] = static_cast<float>(offset[static_cast<Eigen::Index>(axis)]);
  }
  computed_ = MakeSelection();
  binding_force_ = FloatArray(kVertexFloats * (bindings_.size() + 1));
  contacts_.reserve(kReservedContacts);
  contact_force_.reserve(kReservedContacts);
  contact_product_.reserve(kReservedContacts);
  contact_row_.reserve(kReservedContacts);
  row_weights_ = FloatArray(particles.raw().size());
  shares_.assign(static_cast<std::size_t>(partition.count()), {});
  for (std::uint32_t i = 0; i < bindings_.size(); ++i) {
    const Element& e = bindings_[i];
    for (std::size_t k = 0; k < 4; ++k) {
      shares_[static_cast<std::size_t>(partition.Of(e.at[k]))].push_back({i, e.weight[k], e.at[k]});
    }
  }
  hinges_.AssignRegions(partition);
}

void Elements::UpdateTopology(const TissueModel& tissue) {
  for (std::size_t i = 0; i < bindings_.size(); ++i) {
    const Index node = binding_rest_[i].node;
    bindings_[i].active = node == kNoIndex || tissue.NodeAlive(node);
    if (!bindings_[i].active) {
      std::fill_n(binding_force_.data() + kVertexFloats * i, kVertexFloats, 0.0f);
    }
  }
  hinges_.UpdateTopology(tissue);
}

std::vector<std::pair<std::uint32_t, float>> Elements::Diagonal(const ElasticModel& model,
                                                                const ParticleStore& particles) {
  std::vector<std::pair<std::uint32_t, float>> diagonal;
  const auto add = [&](Index particle, double stiffness, double weight) {
    const auto w = static_cast<float>(weight);
    diagonal.emplace_back(particles.Ref(particle).base, static_cast<float>(stiffness) * w * w);
  };
  for (const ElasticHinge& hinge : model.hinges) {
    for (std::size_t k = 0; k < 4; ++k) {
      add(hinge.v[k], hinge.stiffness, hinge.c[k]);
    }
  }
  for (const ElasticBinding& binding : model.bindings) {
    add(binding.membrane, binding.stiffness, 1.0);
    for (std::size_t k = 0; k < 3; ++k) {
      add(binding.surface[k], binding.stiffness, -binding.barycentric[k]);
    }
  }
  for (const ElasticHinge& attachment : model.attachments) {
    for (std::size_t k = 0; k < 4; ++k) {
      add(attachment.v[k], attachment.stiffness, attachment.c[k]);
    }
  }
  return diagonal;
}

Selection Elements::MakeSelection() const {
  Selection selection;
  selection.bindings.reserve(bindings_.size());
  selection.hinge_rows.reserve(hinges_.row_count());
  return selection;
}

void Elements::SelectComputed(const Regions& regions) {
  Select(regions.partition(), regions.computed().marked, regions.computed().marked, &computed_);
}

void Elements::Select(const Partition& partition, std::span<const std::uint8_t> moved,
                      std::span<const std::uint8_t> affected, Selection* selection) const {
  selection->bindings.clear();
  for (std::uint32_t i = 0; i < bindings_.size(); ++i) {
    if (bindings_[i].active && AnyMarked(bindings_[i], partition, moved)) {
      selection->bindings.push_back(i);
    }
  }
  hinges_.Select(partition, affected, &selection->hinge_rows);
}

void Elements::FindContacts(float h, const float* place, const float* start, const Regions& regions,
                            std::span<const ContactRow> contacts) {
  contacts_.clear();
  contact_force_.clear();
  contact_row_.clear();
  for (std::uint32_t i = 0; i < contacts.size(); ++i) {
    const ContactRow& row = contacts[i];
    if (!regions.all_computed() && !AnyMarked(row, regions.partition(), regions.computed().marked)) {
      continue;
    }
    const ContactState state = StateOf(h, row, Combine(row, place), start);
    if (state.stiffness > 0.0f) {
      Element e;
      e.count = row.count;
      e.at = row.at;
      e.weight = row.weight;
      e.kt = state.tangential;
      e.m = row.normal * std::sqrt(std::max(state.stiffness + state.damping - e.kt, 0.0f));
      contacts_.push_back(e);
      contact_row_.push_back(i);
      contact_force_.push_back(row.normal * state.force - state.slide * state.tangential);
    }
  }
}

void Elements::LineariseBindings(const float* place) {
  for (const std::uint32_t i : computed_.bindings) {
    Element& e = bindings_[i];
    const __m128 d = _mm_sub_ps(CombineBinding(e, place), _mm_load_ps(binding_rest_[i].offset.data()));
    const float length = std::max(std::sqrt(_mm_cvtss_f32(Dot3(d, d))), kLeastBindingLength_m),
                k = binding_rest_[i].stiffness;
    const float tension = k * (length - binding_rest_[i].length);
    e.kt = std::max(tension / length, 0.0f);
    alignas(16) float m[4];
    _mm_store_ps(m, _mm_mul_ps(d, _mm_set1_ps(std::sqrt(std::max(k - e.kt, 0.0f)) / length)));
    e.m = Vec3f(m[0], m[1], m[2]);
    _mm_store_ps(binding_force_.data() + kVertexFloats * std::size_t{i}, _mm_mul_ps(d, _mm_set1_ps(-tension / length)));
  }
}

void Elements::AddContactForces(float* residual) const {
  guard_.AddForce(residual);
  slides_.AddForce(residual);
  if (has_clips()) clips_->AddForce(residual);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    Spread(contacts_[i], contact_force_[i], residual);
  }
}

double Elements::MultiplyBindingsAndContacts(const float* p, const Selection& selection) {
  double sum = 0;
  for (const std::uint32_t i : selection.bindings) {
    const Element& e = bindings_[i];
    const __m128 d = CombineBinding(e, p), m = Xyz(e.m);
    const __m128 force = _mm_add_ps(_mm_mul_ps(_mm_set1_ps(e.kt), d), _mm_mul_ps(m, Dot3(m, d)));
    sum += static_cast<double>(_mm_cvtss_f32(Dot3(d, force)));
    _mm_store_ps(binding_force_.data() + kVertexFloats * std::size_t{i}, force);
  }
  contact_product_.clear();
  for (const Element& e : contacts_in_product()) {
    const Vec3f d = Combine(e, p), force = e.kt * d + e.m * e.m.dot(d);
    sum += static_cast<double>(d.dot(force));
    contact_product_.push_back(force);
  }
  sum += slides_.Multiply(p);
  return has_clips() ? sum + clips_->Multiply(p) : sum;
}

double Elements::AddContactProduct(const float* p, float scale, float* out) {
  const double sum = guard_.Apply(p, scale, out);
  slides_.AddProduct(scale, out);
  if (has_clips()) clips_->AddProduct(scale, out);
  const std::span<const Element> contacts = contacts_in_product();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Spread(contacts[i], scale * contact_product_[i], out);
  }
  return sum;
}

void Elements::AddInRegion(int region, float* field) const {
  for (const Share& share : shares_[static_cast<std::size_t>(region)]) {
    AddShare(share.weight, share.at, _mm_load_ps(binding_force_.data() + kVertexFloats * std::size_t{share.binding}),
             field);
  }
  hinges_.AddInRegion(region, field);
}

void Elements::Add(const Selection& selection, float* field) const {
  for (const std::uint32_t i : selection.bindings) {
    const Element& e = bindings_[i];
    for (std::size_t k = 0; k < 4; ++k) {
      AddShare(e.weight[k], e.at[k], _mm_load_ps(binding_force_.data() + kVertexFloats * std::size_t{i}), field);
    }
  }
  hinges_.Add(field, selection.hinge_rows);
}

double Elements::EnergyOfBindingsAndContacts(const float* place, std::span<const ContactRow> contacts) const {
  double sum = guard_.Energy(place) + slides_.Energy(place);
  if (has_clips()) sum += clips_->Energy(place);
  for (const std::uint32_t i : computed_.bindings) {
    const __m128 d = _mm_sub_ps(CombineBinding(bindings_[i], place), _mm_load_ps(binding_rest_[i].offset.data()));
    const float stretch = std::sqrt(_mm_cvtss_f32(Dot3(d, d))) - binding_rest_[i].length;
    sum += 0.5 * static_cast<double>(binding_rest_[i].stiffness * stretch * stretch);
  }
  for (const ContactRow& row : contacts) {
    const float depth = std::max(row.offset - row.normal.dot(Combine(row, place)), 0.0f);
    sum += static_cast<double>(depth > 0.0f ? ElasticOf(row, depth).energy : 0.0f);
  }
  return sum;
}

void Elements::WriteForces(float h, const float* place, const float* d, const float* start,
                           std::span<ContactRow> contacts) {
  for (ContactRow& row : contacts) {
    if (!(ContactStiffness(row) > kStiffContact_N_per_m)) {
      continue;
    }
    const ContactState state = StateOf(h, row, Combine(row, place) + Combine(row, d), start);
    row.force_N = std::max(state.force, 0.0f);
    row.friction_N = state.force > 0.0f ? Vec3f(-state.tangential * state.slide) : Vec3f(Vec3f::Zero());
  }
}

void Elements::WriteUnbalanced(const float* d, const float* residual, const Regions& regions,
                               std::span<ContactRow> contacts) {
  // A contact of two solids can be as stiff, but its weights sum to 0, so that a share of them is no part of anything.
  const auto of_tool = [&](std::size_t i) { return IsStiff(contacts_[i]) && !IsTissue(contacts[contact_row_[i]]); };
  const auto for_particles = [&](const auto& body) {
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      for (std::size_t k = 0; of_tool(i) && k < static_cast<std::size_t>(contacts_[i].count); ++k) {
        body(i, contacts_[i].at[k], contacts_[i].weight[k]);
      }
    }
  };
  for_particles([&](std::size_t, ParticleRef at, float) { row_weights_[at.base] = 0.0f; });
  for_particles([&](std::size_t, ParticleRef at, float weight) { row_weights_[at.base] += weight; });
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (of_tool(i)) {
      const Element& e = contacts_[i];
      ContactRow& row = contacts[contact_row_[i]];
      const Vec3f along = Combine(e, d), linear = contact_force_[i] - e.kt * along - e.m * e.m.dot(along);
      row.unbalanced_N = row.force_N * row.normal + row.friction_N - linear;
    }
  }
  for_particles([&](std::size_t i, ParticleRef at, float weight) {
    ContactRow& row = contacts[contact_row_[i]];
    const bool computed = regions.all_computed() || regions.computed(regions.partition().Of(at));
    if (computed && row_weights_[at.base] > 0.0f) {
      row.unbalanced_N += weight / row_weights_[at.base] * FieldAt(residual, at);
    }
  });
}

}  // namespace fulcrum::physics::implicit
