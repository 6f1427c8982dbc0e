#include "physics_node/accurate/elements.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/tissue_collision.h"

namespace fulcrum::physics::accurate {
namespace {

/// Sliding slower than this within a step counts as sticking [m].
constexpr float kStick = 1e-6f;
/// Tools and tissue against tissue together; more make the list grow.
constexpr std::size_t kMostContacts = 4608;
/// A contact's resistance to movement along its normal within a substep, over its stiffness: what comes fast does not
/// bounce.
constexpr float kContactDamping = 1.0f;
/// Part of a contact's normal stiffness that resists sliding at most.
constexpr float kTangentialPart = 0.3f;

Vec3f Read(const float* field, ParticleRef r) {
  const std::size_t s = r.step;
  return {field[r.base], field[r.base + s], field[r.base + 2 * s]};
}
void Add(float* field, ParticleRef r, const Vec3f& v) {
  const std::size_t s = r.step;
  field[r.base] += v.x();
  field[r.base + s] += v.y();
  field[r.base + 2 * s] += v.z();
}
template <class Sum>
Vec3f Combine(const Sum& e, const float* field) {
  Vec3f sum = Vec3f::Zero();
  for (int k = 0; k < e.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    sum += e.weight[i] * Read(field, e.at[i]);
  }
  return sum;
}
template <class Sum>
void Spread(const Sum& e, const Vec3f& v, float* field) {
  for (int k = 0; k < e.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    Add(field, e.at[i], e.weight[i] * v);
  }
}

/// What a contact does to its particles at `place`.
struct ContactState {
  float stiffness, damping;  ///< [N/m]; damping against the movement in this substep.
  float force;               ///< Normal, never negative [N].
  float tangential;          ///< Stiffness against sliding [N/m].
  Vec3f slide;
};
ContactState StateOf(const ContactRow& row, const float* place, const float* start) {
  ContactState state{};
  const Vec3f here = Combine(row, place), moved = here - Combine(row, start) - row.drift;
  const float gap = row.normal.dot(here) - row.offset;
  if (!(gap < 0.0f)) {
    return state;
  }
  state.stiffness = Elements::ContactStiffness(row);
  state.damping = kContactDamping * state.stiffness;
  const float approach = row.normal.dot(moved);
  state.force = std::max(-state.stiffness * gap - state.damping * approach, 0.0f);
  // Coulomb with the normal force at hand, within one step linear.
  state.slide = moved - approach * row.normal;
  state.tangential =
      std::min(kTangentialPart * state.stiffness, row.friction * state.force / std::max(state.slide.norm(), kStick));
  return state;
}

}  // namespace

float Elements::ContactStiffness(const ContactRow& row) {
  constexpr float kTool = 2000.0f, kTissue = 30.0f;
  return (row.source & TissueCollision::kSource) != 0 ? kTissue : kTool;
}

Elements::Elements(const SceneView& scene, const ElasticModel& model, const ParticleStore& particles) {
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
  for (const ElasticHinge& hinge : model.hinges) {
    Element e;
    Vec3d rest = Vec3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      e.at[k] = particles.Ref(hinge.v[k]);
      e.weight[k] = static_cast<float>(hinge.c[k]);
      rest += hinge.c[k] * model.rest_position[hinge.v[k]];
    }
    e.kt = static_cast<float>(hinge.stiffness);
    hinges_.push_back(e);
    hinge_rest_.push_back(rest.cast<float>());
  }
  contacts_.reserve(kMostContacts);
  contact_force_.reserve(kMostContacts);
}

void Elements::Follow(const TissueModel& tissue) {
  for (std::size_t i = 0; i < bindings_.size(); ++i) {
    bindings_[i].active = tissue.NodeAlive(binding_rest_[i].node);
  }
  for (std::size_t i = 0; i < hinges_.size(); ++i) {
    hinges_[i].active = tissue.HingeWhole(static_cast<Index>(i));
  }
}

std::vector<std::pair<std::uint32_t, float>> Elements::Diagonal() const {
  std::vector<std::pair<std::uint32_t, float>> diagonal;
  const auto add = [&](const Element& e, float stiffness) {
    for (std::size_t k = 0; k < 4; ++k) {
      diagonal.emplace_back(e.at[k].base, stiffness * e.weight[k] * e.weight[k]);
    }
  };
  for (std::size_t i = 0; i < bindings_.size(); ++i) {
    add(bindings_[i], binding_rest_[i].stiffness);
  }
  for (const Element& hinge : hinges_) {
    add(hinge, hinge.kt);
  }
  return diagonal;
}

void Elements::Touch(const float* place, const float* start, std::span<const ContactRow> contacts) {
  contacts_.clear();
  contact_force_.clear();
  for (const ContactRow& row : contacts) {
    const ContactState state = StateOf(row, place, start);
    if (state.force > 0.0f) {
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

void Elements::Linearise(const float* place, float* residual) {
  for (std::size_t i = 0; i < bindings_.size(); ++i) {
    Element& e = bindings_[i];
    if (!e.active) {
      continue;
    }
    const Vec3f d = Combine(e, place);
    const float length = std::max(d.norm(), 1e-9f), k = binding_rest_[i].stiffness;
    const float tension = k * (length - binding_rest_[i].length);
    e.kt = std::max(tension / length, 0.0f);
    e.m = d * (std::sqrt(std::max(k - e.kt, 0.0f)) / length);
    Spread(e, d * (-tension / length), residual);
  }
  for (std::size_t i = 0; i < hinges_.size(); ++i) {
    if (hinges_[i].active) {
      Spread(hinges_[i], (hinge_rest_[i] - Combine(hinges_[i], place)) * hinges_[i].kt, residual);
    }
  }
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    Spread(contacts_[i], contact_force_[i], residual);
  }
}

double Elements::Apply(const float* p, float* out) const {
  double sum = 0;
  const auto apply = [&](const Element& e) {
    const Vec3f d = Combine(e, p);
    const Vec3f force = e.kt * d + e.m * e.m.dot(d);
    sum += static_cast<double>(d.dot(force));
    Spread(e, force, out);
  };
  for (const Element& e : bindings_) {
    if (e.active) {
      apply(e);
    }
  }
  for (const Element& e : hinges_) {
    if (e.active) {
      const Vec3f d = Combine(e, p), force = e.kt * d;
      sum += static_cast<double>(d.dot(force));
      Spread(e, force, out);
    }
  }
  for (const Element& e : contacts_) {
    apply(e);
  }
  return sum;
}

double Elements::Energy(const float* place, std::span<const ContactRow> contacts) const {
  double sum = 0;
  for (std::size_t i = 0; i < bindings_.size(); ++i) {
    if (bindings_[i].active) {
      const float stretch = Combine(bindings_[i], place).norm() - binding_rest_[i].length;
      sum += 0.5 * static_cast<double>(binding_rest_[i].stiffness * stretch * stretch);
    }
  }
  for (std::size_t i = 0; i < hinges_.size(); ++i) {
    if (hinges_[i].active) {
      sum += 0.5 * static_cast<double>(hinges_[i].kt * (Combine(hinges_[i], place) - hinge_rest_[i]).squaredNorm());
    }
  }
  for (const ContactRow& row : contacts) {
    const float gap = std::min(row.normal.dot(Combine(row, place)) - row.offset, 0.0f);
    sum += 0.5 * static_cast<double>(ContactStiffness(row) * gap * gap);
  }
  return sum;
}

void Elements::WriteForces(const float* place, const float* start, std::span<ContactRow> contacts) {
  for (ContactRow& row : contacts) {
    const ContactState state = StateOf(row, place, start);
    row.force_N = state.force;
    row.friction_N = state.force > 0.0f ? Vec3f(-state.tangential * state.slide) : Vec3f(Vec3f::Zero());
  }
}

}  // namespace fulcrum::physics::accurate
