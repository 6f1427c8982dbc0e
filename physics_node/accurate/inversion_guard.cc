#include "physics_node/accurate/inversion_guard.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics::accurate {
namespace {

/// Turned over below 0; kept from falling below this ...
constexpr float kBack = 0.15f;
/// ... until it has recovered to this.
constexpr float kSound = 0.4f;
/// Of the organ's bulk modulus to begin with: enough to open most folds, little enough for the preconditioner, which
/// does not know it. It grows each substep that a fold resists, up to so many times.
constexpr double kPart = 0.3;
constexpr float kGrowth = 1.02f, kMost = 16.0f;

Vec3f At(const float* field, Index v) {
  return {field[4 * std::size_t{v}], field[4 * std::size_t{v} + 1], field[4 * std::size_t{v} + 2]};
}
void Add(float* field, Index v, const Vec3f& value) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    field[4 * std::size_t{v} + axis] += value[static_cast<Eigen::Index>(axis)];
  }
}

}  // namespace

InversionGuard::InversionGuard(const ElasticModel& model) {
  for (const ElasticTet& tet : model.tets) {
    Tet t;
    std::copy(tet.v.begin(), tet.v.end(), t.v.begin());
    t.inverse_volume = static_cast<float>(1.0 / (6.0 * tet.volume));
    t.stiffness = static_cast<float>(kPart * (model.lambda_Pa + model.mu_Pa) * tet.volume);
    tets_.push_back(t);
  }
  found_.reserve(tets_.size());
}

float InversionGuard::RelativeVolume(const Tet& tet, const float* place) const {
  const Vec3f x0 = At(place, tet.v[0]);
  return (At(place, tet.v[1]) - x0).cross(At(place, tet.v[2]) - x0).dot(At(place, tet.v[3]) - x0) * tet.inverse_volume;
}

void InversionGuard::Look(const float* place) {
  std::erase_if(found_, [&](const Found& f) { return !(RelativeVolume(tets_[f.tet], place) < kSound); });
  const std::size_t end = std::min(next_ + tets_.size() / kParts + 1, tets_.size());
  for (; next_ < end; ++next_) {
    if (RelativeVolume(tets_[next_], place) < 0.0f &&
        std::none_of(found_.begin(), found_.end(), [&](const Found& f) { return f.tet == next_; })) {
      Found& found = found_.emplace_back();
      found.tet = next_;
      found.stiffness = tets_[next_].stiffness;
    }
  }
  next_ = next_ == tets_.size() ? 0 : next_;
}

void InversionGuard::Linearise(const float* place, float* residual) {
  Look(place);
  for (Found& found : found_) {
    const Tet& tet = tets_[found.tet];
    const Vec3f x0 = At(place, tet.v[0]), a = At(place, tet.v[1]) - x0, b = At(place, tet.v[2]) - x0,
                c = At(place, tet.v[3]) - x0;
    const float volume = RelativeVolume(tet, place);
    found.stiffness = std::min(found.stiffness * kGrowth, kMost * tet.stiffness);
    const float root = volume < kBack ? std::sqrt(found.stiffness) : 0.0f, scale = root * tet.inverse_volume;
    found.gradient[1] = scale * b.cross(c);
    found.gradient[2] = scale * c.cross(a);
    found.gradient[3] = scale * a.cross(b);
    found.gradient[0] = -(found.gradient[1] + found.gradient[2] + found.gradient[3]);
    const float missing = root * (kBack - volume);
    for (std::size_t k = 0; k < 4; ++k) {
      Add(residual, tet.v[k], missing * found.gradient[k]);
    }
  }
}

double InversionGuard::Apply(const float* p, float* out) const {
  double sum = 0;
  for (const Found& found : found_) {
    const Tet& tet = tets_[found.tet];
    float change = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      change += found.gradient[k].dot(At(p, tet.v[k]));
    }
    for (std::size_t k = 0; k < 4; ++k) {
      Add(out, tet.v[k], change * found.gradient[k]);
    }
    sum += static_cast<double>(change * change);
  }
  return sum;
}

double InversionGuard::Energy(const float* place) const {
  double sum = 0;
  for (const Found& found : found_) {
    const Tet& tet = tets_[found.tet];
    const float missing = std::max(kBack - RelativeVolume(tet, place), 0.0f);
    sum += 0.5 * static_cast<double>(found.stiffness * missing * missing);
  }
  return sum;
}

}  // namespace fulcrum::physics::accurate
