#include "physics_node/implicit/elements.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/tissue_collision.h"
#include "physics_node/simd/sse.h"

namespace fulcrum::physics::implicit {
namespace {

/// Sliding slower than this within a step counts as sticking [m].
constexpr float kStick = 1e-6f;
/// Tools and tissue against tissue together; more make the list grow.
constexpr std::size_t kMostContacts = 4608;
/// A contact's resistance to movement along its normal within a substep, over its stiffness: what comes fast does not
/// bounce.
constexpr float kContactDamping = 1.0f;
/// A contact's viscosity against sliding over its normal stiffness, at most [s]. By time and not by substep: else what
/// sticks creeps slowly in long substeps and at once in short ones.
constexpr float kSlideTime = 3e-4f;
/// Depth over which the contact of a tool gets stiff [m]: more than a tool moves in a substep (0.06 mm at most while it
/// presses). Stiff at once, contacts come and go all together: in one substep some are missing from the linearisation,
/// in the next they push back what fell in meanwhile, and the force of a tool that moves along a surface, be it by the
/// rounding of its place, jumps by more than itself.
constexpr float kOnset = 8e-5f;

template <class Sum>
Vec3f Combine(const Sum& e, const float* field) {
  Vec3f sum = Vec3f::Zero();
  for (int k = 0; k < e.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    sum += e.weight[i] * FieldAt(field, e.at[i]);
  }
  return sum;
}
template <class Sum>
void Spread(const Sum& e, const Vec3f& v, float* field) {
  for (int k = 0; k < e.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    AddField(field, e.at[i], e.weight[i] * v);
  }
}

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
bool AnyMarked(const Sum& e, const Regions& regions, std::span<const std::uint8_t> marked) {
  for (int k = 0; k < e.count; ++k) {
    if (marked[static_cast<std::size_t>(regions.Of(e.at[static_cast<std::size_t>(k)]))] != 0) {
      return true;
    }
  }
  return false;
}

/// Of a contact `depth` deep, without damping.
struct Elastic {
  float force;      ///< [N]
  float stiffness;  ///< d force / d depth [N/m]
  float energy;     ///< [J]
};
Elastic ElasticOf(const ContactRow& row, float depth) {
  const float full = Elements::ContactStiffness(row), onset = Elements::IsTissue(row) ? 0.0f : kOnset;
  if (depth < onset) {
    const float stiffness = full * depth / onset;
    return {0.5f * stiffness * depth, stiffness, stiffness * depth * depth / 6.0f};
  }
  const float past = depth - 0.5f * onset;
  return {full * past, full, full * (0.5f * past * past + onset * onset / 24.0f)};
}

/// What a contact does to its particles at `place`.
struct ContactState {
  float stiffness, damping;  ///< [N/m]; damping against the movement in this substep.
  /// Normal [N]. Negative while what has penetrated leaves faster than the contact alone would drive it: cut off there,
  /// the contact would be missing from the solve that should hold it in place, and chatter.
  float force;
  float tangential;  ///< Stiffness against sliding [N/m].
  Vec3f slide;
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
  // Coulomb with the normal force at hand, viscous below it.
  state.slide = moved - approach * row.normal;
  state.tangential = std::min(kSlideTime / h * state.stiffness,
                              row.friction * std::max(state.force, 0.0f) / std::max(state.slide.norm(), kStick));
  return state;
}

}  // namespace

float Elements::ContactStiffness(const ContactRow& row) {
  constexpr float kTool = 2000.0f, kTissue = 30.0f;
  return IsTissue(row) ? kTissue : kTool;
}
bool Elements::IsTissue(const ContactRow& row) { return (row.source & TissueCollision::kSource) != 0; }

Elements::Elements(const SceneView& scene, const ElasticModel& model, const ParticleStore& particles)
    : hinges_(model, particles), guard_(model) {
  for (const ElasticBinding& binding : model.bindings) {
    Element e;
    e.at[0] = particles.Ref(binding.membrane);
    e.weight[0] = 1.0f;
    for (std::size_t i = 0; i < 3; ++i) {
      e.at[i + 1] = particles.Ref(binding.surface[i]);
      e.weight[i + 1] = -static_cast<float>(binding.barycentric[i]);
    }
    bindings_.push_back(e);
    binding_rest_.push_back({static_cast<float>(binding.rest_length), static_cast<float>(binding.stiffness),
                             binding.membrane - scene.membrane.first});
  }
  computed_.bindings.reserve(bindings_.size());
  binding_force_ = FloatArray(4 * bindings_.size() + 4);
  contacts_.reserve(kMostContacts);
  contact_force_.reserve(kMostContacts);
  contact_product_.reserve(kMostContacts);
}

void Elements::Divide(const Regions& regions) {
  shares_.assign(static_cast<std::size_t>(regions.count()), {});
  for (std::uint32_t i = 0; i < bindings_.size(); ++i) {
    const Element& e = bindings_[i];
    for (std::size_t k = 0; k < 4; ++k) {
      shares_[static_cast<std::size_t>(regions.Of(e.at[k]))].push_back({i, e.weight[k], e.at[k]});
    }
  }
  hinges_.Divide(regions);
}

void Elements::Follow(const TissueModel& tissue) {
  for (std::size_t i = 0; i < bindings_.size(); ++i) {
    bindings_[i].active = tissue.NodeAlive(binding_rest_[i].node);
    if (!bindings_[i].active) {
      std::fill_n(binding_force_.data() + 4 * i, 4, 0.0f);
    }
  }
  hinges_.Follow(tissue);
}

std::vector<std::pair<std::uint32_t, float>> Elements::Diagonal() const {
  std::vector<std::pair<std::uint32_t, float>> diagonal = hinges_.Diagonal();
  for (std::size_t i = 0; i < bindings_.size(); ++i) {
    const Element& e = bindings_[i];
    for (std::size_t k = 0; k < 4; ++k) {
      diagonal.emplace_back(e.at[k].base, binding_rest_[i].stiffness * e.weight[k] * e.weight[k]);
    }
  }
  return diagonal;
}

void Elements::FollowRegions(const Regions& regions) {
  Select(regions, regions.part().marked, regions.part().marked, &computed_);
}

void Elements::Select(const Regions& regions, std::span<const std::uint8_t> moved, std::span<const std::uint8_t> felt,
                      Selection* selection) const {
  selection->bindings.clear();
  for (std::uint32_t i = 0; i < bindings_.size(); ++i) {
    if (bindings_[i].active && AnyMarked(bindings_[i], regions, moved)) {
      selection->bindings.push_back(i);
    }
  }
  hinges_.Select(regions, felt, &selection->hinge_rows);
}

void Elements::Touch(float h, const float* place, const float* start, const Regions& regions,
                     std::span<const ContactRow> contacts) {
  contacts_.clear();
  contact_force_.clear();
  for (const ContactRow& row : contacts) {
    if (!regions.everything() && !AnyMarked(row, regions, regions.part().marked)) {
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
      contact_force_.push_back(row.normal * state.force - state.slide * state.tangential);
    }
  }
}

void Elements::LookForFolds(const float* place) { guard_.Linearise(place); }

void Elements::LineariseOthers(const float* place) {
  for (const std::uint32_t i : computed_.bindings) {
    Element& e = bindings_[i];
    const __m128 d = CombineBinding(e, place);
    const float length = std::max(std::sqrt(_mm_cvtss_f32(Dot3(d, d))), 1e-9f), k = binding_rest_[i].stiffness;
    const float tension = k * (length - binding_rest_[i].length);
    e.kt = std::max(tension / length, 0.0f);
    alignas(16) float m[4];
    _mm_store_ps(m, _mm_mul_ps(d, _mm_set1_ps(std::sqrt(std::max(k - e.kt, 0.0f)) / length)));
    e.m = Vec3f(m[0], m[1], m[2]);
    _mm_store_ps(binding_force_.data() + 4 * std::size_t{i}, _mm_mul_ps(d, _mm_set1_ps(-tension / length)));
  }
}

void Elements::AddContactForces(float* residual) const {
  guard_.AddForce(residual);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    Spread(contacts_[i], contact_force_[i], residual);
  }
}

double Elements::MultiplyOthers(const float* p, const Selection& selection) {
  double sum = 0;
  for (const std::uint32_t i : selection.bindings) {
    const Element& e = bindings_[i];
    const __m128 d = CombineBinding(e, p), m = Xyz(e.m);
    const __m128 force = _mm_add_ps(_mm_mul_ps(_mm_set1_ps(e.kt), d), _mm_mul_ps(m, Dot3(m, d)));
    sum += static_cast<double>(_mm_cvtss_f32(Dot3(d, force)));
    _mm_store_ps(binding_force_.data() + 4 * std::size_t{i}, force);
  }
  contact_product_.clear();
  for (const Element& e : contacts_in_product()) {
    const Vec3f d = Combine(e, p), force = e.kt * d + e.m * e.m.dot(d);
    sum += static_cast<double>(d.dot(force));
    contact_product_.push_back(force);
  }
  return sum;
}

double Elements::AddContactProduct(const float* p, float scale, float* out) {
  const double sum = guard_.Apply(p, scale, out);
  const std::span<const Element> contacts = contacts_in_product();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Spread(contacts[i], scale * contact_product_[i], out);
  }
  return sum;
}

void Elements::AddInRegion(int region, float* field) const {
  for (const Share& share : shares_[static_cast<std::size_t>(region)]) {
    AddShare(share.weight, share.at, _mm_load_ps(binding_force_.data() + 4 * std::size_t{share.binding}), field);
  }
  hinges_.AddInRegion(region, field);
}

void Elements::Add(const Selection& selection, float* field) const {
  for (const std::uint32_t i : selection.bindings) {
    const Element& e = bindings_[i];
    for (std::size_t k = 0; k < 4; ++k) {
      AddShare(e.weight[k], e.at[k], _mm_load_ps(binding_force_.data() + 4 * std::size_t{i}), field);
    }
  }
  hinges_.Add(field, selection.hinge_rows);
}

double Elements::EnergyOfOthers(const float* place, std::span<const ContactRow> contacts) const {
  double sum = guard_.Energy(place);
  for (const std::uint32_t i : computed_.bindings) {
    const __m128 d = CombineBinding(bindings_[i], place);
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
    if (!(ContactStiffness(row) > kStiffContact)) {
      continue;
    }
    const ContactState state = StateOf(h, row, Combine(row, place) + Combine(row, d), start);
    row.force_N = std::max(state.force, 0.0f);
    row.friction_N = state.force > 0.0f ? Vec3f(-state.tangential * state.slide) : Vec3f(Vec3f::Zero());
  }
}

}  // namespace fulcrum::physics::implicit
