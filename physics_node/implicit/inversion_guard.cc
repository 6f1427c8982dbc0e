#include "physics_node/implicit/inversion_guard.h"

#include <Eigen/SVD>
#include <algorithm>

#include "physics_node/implicit/kernels.h"

namespace fulcrum::physics::implicit {
namespace {

/// k over the shear modulus: a fold in the wall of a mirrored organ opens from 5 on; at 20 single tetrahedra snap.
constexpr double kStiffnessOverShear = 10;
/// |F - R| below which a tetrahedron is released. So near rest that little energy is released with it: released as soon
/// as its orientation was right, it fell back and was found again, and the wall shook for ever.
constexpr float kReleaseStrain = 0.1f;

Vec3f At(const float* field, Index v) {
  return {field[kVertexFloats * std::size_t{v}], field[kVertexFloats * std::size_t{v} + 1],
          field[kVertexFloats * std::size_t{v} + 2]};
}
void Add(float* field, Index v, const Vec3f& value) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    field[kVertexFloats * std::size_t{v} + axis] += value[static_cast<Eigen::Index>(axis)];
  }
}

/// F - R for the rotation R nearest to F, by singular values.
Eigen::Matrix3f Strain(const Eigen::Matrix3f& f) {
  const Eigen::JacobiSVD<Eigen::Matrix3f> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3f u = svd.matrixU();
  if (u.determinant() * svd.matrixV().determinant() < 0.0f) {
    u.col(2) *= -1.0f;  // A mirror image is turned back along its least stretch.
  }
  return f - u * svd.matrixV().transpose();
}

}  // namespace

InversionGuard::InversionGuard(const ElasticModel& model, std::span<const Index> solid) {
  for (const ElasticTet& tet : model.tets) {
    const Index of = solid.empty() ? 0 : solid[tet.v[0]];
    if (parts_.empty() || parts_.back().solid != of) parts_.push_back({of, tets_.size(), tets_.size()});
    ++parts_.back().end;
    ++parts_.back().due;
    Vertices& vertices = tets_.emplace_back();
    std::copy(tet.v.begin(), tet.v.end(), vertices.begin());
    Shape& shape = shapes_.emplace_back();
    shape.stiffness = static_cast<float>(kStiffnessOverShear * tet.scale * model.mu_Pa * tet.volume);
    for (std::size_t k = 1; k < 4; ++k) {
      shape.gradient[k] = tet.inverse_edges.row(static_cast<Eigen::Index>(k) - 1).transpose().cast<float>();
      shape.gradient[0] -= shape.gradient[k];
    }
  }
  found_.reserve(tets_.size());
  folded_.reserve(parts_.size());
}

Eigen::Matrix3f InversionGuard::Gradient(std::size_t tet, const float* place) const {
  Eigen::Matrix3f f = Eigen::Matrix3f::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    f += At(place, tets_[tet][k]) * shapes_[tet].gradient[k].transpose();
  }
  return f;
}

void InversionGuard::Scan(const float* place, std::span<const std::uint8_t> computed) {
  std::size_t all = 0;
  for (Part& part : parts_) {
    if (computed.empty() || computed[part.solid] != 0) part.due = part.end - part.first;
    all += part.due > 0 ? part.end - part.first : 0;
  }
  std::size_t left = all / kScanSubsteps + 1;
  for (Part& part : parts_) {
    if (next_ >= part.end || left == 0) continue;
    if (part.due == 0) {
      next_ = part.end;
      continue;
    }
    const std::size_t end = std::min(next_ + left, part.end);
    left -= end - next_;
    part.due -= std::min(end - next_, part.due);
    for (; next_ < end; ++next_) {
      const Vertices& v = tets_[next_];
      const Vec3f x0 = At(place, v[0]);
      const float volume = (At(place, v[1]) - x0).cross(At(place, v[2]) - x0).dot(At(place, v[3]) - x0);
      if (volume <= 0.0f &&
          std::none_of(found_.begin(), found_.end(), [&](const Found& found) { return found.tet == next_; })) {
        found_.emplace_back().tet = next_;
      }
    }
  }
  next_ = next_ == tets_.size() ? 0 : next_;
}

void InversionGuard::Linearise(const float* place, std::span<const std::uint8_t> computed) {
  Scan(place, computed);
  for (Found& found : found_) {
    const Eigen::Matrix3f f = Gradient(found.tet, place);
    // Particles that are not finite are reset at the end of the substep; the next scan examines them again.
    found.strain = f.allFinite() ? Strain(f) : Eigen::Matrix3f::Zero();
  }
  std::erase_if(found_,
                [](const Found& found) { return found.strain.squaredNorm() < kReleaseStrain * kReleaseStrain; });
  folded_.clear();
  for (const Part& part : parts_) {
    const auto is_of_part = [&](const Found& found) { return found.tet >= part.first && found.tet < part.end; };
    if (std::ranges::any_of(found_, is_of_part)) folded_.push_back(part.solid);
  }
}

void InversionGuard::AddForce(float* residual) const {
  for (const Found& found : found_) {
    const Shape& shape = shapes_[found.tet];
    for (std::size_t k = 0; k < 4; ++k) {
      Add(residual, tets_[found.tet][k], -shape.stiffness * (found.strain * shape.gradient[k]));
    }
  }
}

double InversionGuard::Apply(const float* p, float scale, float* out) const {
  double sum = 0;
  for (const Found& found : found_) {
    const Shape& shape = shapes_[found.tet];
    const Eigen::Matrix3f f = Gradient(found.tet, p);
    for (std::size_t k = 0; k < 4; ++k) {
      Add(out, tets_[found.tet][k], scale * shape.stiffness * (f * shape.gradient[k]));
    }
    sum += static_cast<double>(shape.stiffness * f.squaredNorm());
  }
  return sum;
}

double InversionGuard::Curvature(const float* p) const {
  double sum = 0;
  for (const Found& found : found_) {
    sum += static_cast<double>(shapes_[found.tet].stiffness * Gradient(found.tet, p).squaredNorm());
  }
  return sum;
}

double InversionGuard::Energy(const float* place) const {
  double sum = 0;
  for (const Found& found : found_) {
    sum += 0.5 * static_cast<double>(shapes_[found.tet].stiffness * Strain(Gradient(found.tet, place)).squaredNorm());
  }
  return sum;
}

}  // namespace fulcrum::physics::implicit
