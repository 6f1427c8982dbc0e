#include "physics_node/implicit/hinge_matrix.h"

#include <algorithm>
#include <map>

#include "physics_node/implicit/kernels.h"
#include "physics_node/simd/sse.h"

namespace fulcrum::physics::implicit {
namespace {

/// Rows over particles from which on a copy of all particles next to one another costs less than gathering the columns
/// of each row from the field: one in four. Assumed.
constexpr std::size_t kGatherRatio = 4;

}  // namespace

HingeMatrix::HingeMatrix(const ElasticModel& model, const ParticleStore& particles) {
  std::map<Index, std::uint32_t> number;
  for (const ElasticHinge& hinge : model.hinges) {
    for (const Index v : hinge.v) {
      number.try_emplace(v, 0);
    }
  }
  rest_ = FloatArray(kVertexFloats * number.size());
  vector_ = FloatArray(kVertexFloats * number.size());
  product_ = FloatArray(kVertexFloats * number.size());
  for (auto& [v, n] : number) {
    n = static_cast<std::uint32_t>(particles_.size());
    for (int axis = 0; axis < 3; ++axis) {
      rest_[kVertexFloats * std::size_t{n} + static_cast<std::size_t>(axis)] =
          static_cast<float>(model.rest_position[v][axis]);
    }
    particles_.push_back(particles.Ref(v));
  }
  std::vector<std::vector<std::uint32_t>> columns(particles_.size());
  for (const ElasticHinge& hinge : model.hinges) {
    Hinge h;
    h.stiffness = static_cast<float>(hinge.stiffness);
    for (std::size_t k = 0; k < 4; ++k) {
      h.particle[k] = number[hinge.v[k]];
      h.weight[k] = static_cast<float>(hinge.c[k]);
    }
    for (const std::uint32_t a : h.particle) {
      columns[a].insert(columns[a].end(), h.particle.begin(), h.particle.end());
    }
    hinges_.push_back(h);
  }
  start_.push_back(0);
  for (std::vector<std::uint32_t>& row : columns) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    column_.insert(column_.end(), row.begin(), row.end());
    start_.push_back(static_cast<std::uint32_t>(column_.size()));
  }
  value_.resize(column_.size());
  Assemble();
}

void HingeMatrix::Assemble() {
  std::fill(value_.begin(), value_.end(), 0.0f);
  for (const Hinge& hinge : hinges_) {
    if (!hinge.whole) {
      continue;
    }
    for (std::size_t a = 0; a < 4; ++a) {
      const auto first = column_.begin() + start_[hinge.particle[a]],
                 end = column_.begin() + start_[hinge.particle[a] + 1];
      for (std::size_t b = 0; b < 4; ++b) {
        const auto at = std::lower_bound(first, end, hinge.particle[b]) - column_.begin();
        value_[static_cast<std::size_t>(at)] += hinge.stiffness * hinge.weight[a] * hinge.weight[b];
      }
    }
  }
}

void HingeMatrix::UpdateTopology(const TissueModel& tissue) {
  bool changed = false;
  for (Index i = 0; i < hinges_.size(); ++i) {
    changed |= hinges_[i].whole != tissue.HingeWhole(i);
    hinges_[i].whole = tissue.HingeWhole(i);
  }
  if (changed) {
    Assemble();
  }
}

void HingeMatrix::AssignRegions(const Partition& partition) {
  in_region_.assign(static_cast<std::size_t>(partition.count()), {});
  for (std::uint32_t i = 0; i < particles_.size(); ++i) {
    in_region_[static_cast<std::size_t>(partition.Of(particles_[i]))].push_back(i);
  }
}

void HingeMatrix::Select(const Partition& partition, std::span<const std::uint8_t> marked,
                         std::vector<std::uint32_t>* rows) const {
  rows->clear();
  for (std::uint32_t i = 0; i < particles_.size(); ++i) {
    if (marked[static_cast<std::size_t>(partition.Of(particles_[i]))] != 0) {
      rows->push_back(i);
    }
  }
}

void HingeMatrix::Gather(const float* field, const float* minus) {
  float* to = vector_.data();
  for (const ParticleRef at : particles_) {
    const std::size_t step = at.step;
    const float* from = field + at.base;
    _mm_store_ps(to, _mm_sub_ps(_mm_set_ps(0, from[2 * step], from[step], from[0]),
                                minus ? _mm_load_ps(minus) : _mm_setzero_ps()));
    to += kVertexFloats;
    minus = minus ? minus + kVertexFloats : nullptr;
  }
}

template <class Load, class Use>
double HingeMatrix::ForRows(std::span<const std::uint32_t> rows, const Load& load, const Use& use) const {
  double dot = 0;
  alignas(16) float row[4], here[4];
  for (const std::uint32_t i : rows) {
    __m128 sum = _mm_setzero_ps();
    for (std::uint32_t k = start_[i]; k < start_[i + 1]; ++k) {
      sum = _mm_add_ps(sum, _mm_mul_ps(_mm_set1_ps(value_[k]), load(column_[k])));
    }
    _mm_store_ps(row, sum);
    use(i, sum);
    _mm_store_ps(here, load(i));
    dot += static_cast<double>(here[0] * row[0] + here[1] * row[1] + here[2] * row[2]);
  }
  return dot;
}

void HingeMatrix::MakeForce(const float* place, std::span<const std::uint32_t> rows) {
  Gather(place, rest_.data());
  const auto load = [this](std::uint32_t k) { return _mm_load_ps(vector_.data() + kVertexFloats * std::size_t{k}); };
  (void)ForRows(rows, load, [&](std::uint32_t i, __m128 row) {
    _mm_store_ps(product_.data() + kVertexFloats * std::size_t{i}, _mm_sub_ps(_mm_setzero_ps(), row));
  });
}

double HingeMatrix::Multiply(const float* p, std::span<const std::uint32_t> rows) {
  const auto keep = [&](std::uint32_t i, __m128 row) {
    _mm_store_ps(product_.data() + kVertexFloats * std::size_t{i}, row);
  };
  if (kGatherRatio * rows.size() < particles_.size()) {
    const auto load = [&](std::uint32_t k) {
      const float* from = p + particles_[k].base;
      const std::size_t step = particles_[k].step;
      return _mm_set_ps(0, from[2 * step], from[step], from[0]);
    };
    return ForRows(rows, load, keep);
  }
  Gather(p, nullptr);
  return ForRows(
      rows, [this](std::uint32_t k) { return _mm_load_ps(vector_.data() + kVertexFloats * std::size_t{k}); }, keep);
}

void HingeMatrix::Add(float* field, std::span<const std::uint32_t> rows) const {
  for (const std::uint32_t i : rows) {
    const float* row = product_.data() + kVertexFloats * std::size_t{i};
    const std::size_t step = particles_[i].step;
    float* at = field + particles_[i].base;
    at[0] += row[0];
    at[step] += row[1];
    at[2 * step] += row[2];
  }
}

double HingeMatrix::Energy(const float* place, std::span<const std::uint32_t> rows) {
  Gather(place, rest_.data());
  const auto load = [this](std::uint32_t k) { return _mm_load_ps(vector_.data() + kVertexFloats * std::size_t{k}); };
  return 0.5 * ForRows(rows, load, [](std::uint32_t, __m128) {});
}

}  // namespace fulcrum::physics::implicit
