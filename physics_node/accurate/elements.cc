#include "physics_node/accurate/elements.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics::accurate {
namespace {

/// Sliding slower than this within a step counts as sticking [m].
constexpr float kStick = 1e-6f;
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

}  // namespace

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
  contacts_.reserve(4096);
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

void Elements::Linearise(const float* place, const float* start, std::span<const ContactRow> contacts,
                         float* residual) {
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
  contacts_.clear();
  for (const ContactRow& row : contacts) {
    const Vec3f here = Combine(row, place);
    const float gap = row.normal.dot(here) - row.offset;
    if (!(gap < 0.0f)) {
      continue;
    }
    Element e;
    e.count = row.count;
    e.at = row.at;
    e.weight = row.weight;
    // Coulomb with the normal force at hand: sliding resisted by at most friction * N, within one step linear.
    Vec3f slide = here - Combine(row, start) - row.drift;
    slide -= row.normal.dot(slide) * row.normal;
    const float limit = row.friction * kContactStiffness * -gap;
    e.kt = std::min(kTangentialPart * kContactStiffness, limit / std::max(slide.norm(), kStick));
    e.m = row.normal * std::sqrt(std::max(kContactStiffness - e.kt, 0.0f));
    Spread(e, row.normal * (-kContactStiffness * gap) - slide * e.kt, residual);
    contacts_.push_back(e);
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
    sum += 0.5 * static_cast<double>(kContactStiffness * gap * gap);
  }
  return sum;
}

void Elements::WriteForces(const float* place, const float* start, std::span<ContactRow> contacts) {
  for (ContactRow& row : contacts) {
    const Vec3f here = Combine(row, place);
    row.force_N = kContactStiffness * std::max(row.offset - row.normal.dot(here), 0.0f);
    row.friction_N.setZero();
    if (row.force_N > 0.0f && row.friction > 0.0f) {
      Vec3f slide = here - Combine(row, start) - row.drift;
      slide -= row.normal.dot(slide) * row.normal;
      const float k =
          std::min(kTangentialPart * kContactStiffness, row.friction * row.force_N / std::max(slide.norm(), kStick));
      row.friction_N = -k * slide;
    }
  }
}

}  // namespace fulcrum::physics::accurate
