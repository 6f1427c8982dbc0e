#include "physics_node/contact_model/surface_curvature.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace fulcrum::physics {
namespace {

/// Radius of the fit [m]: three times the reach of a tip, so that finer folds are averaged; but at least and at most
/// this many of the longest edges of the contact's triangle, where the mesh is coarse or fine.
constexpr float kRadius = 0.006f;
constexpr float kMinEdges = 2.5f, kMaxEdges = 6.0f;
/// Least pivot of the normal equations, for coordinates over the radius and weights with sum 1. A whole disc has 2e-3,
/// a border half of that; with points on two lines through the middle only, the twist is undetermined and the pivot 0.
constexpr double kLeastPivot = 1e-4;
/// Least cosine between the contact's normal and that of the triangle; with less it is not a normal of the surface.
constexpr float kLeastCosine = 0.3f;
/// Least 1 + kappa r: a ball in a pit of less than twice its radius touches on both sides.
constexpr float kLeastRolled = 0.5f;
/// Fits of a quadric: the second one is in the frame of the first one's normal, because the Hessian is the shape
/// operator only where the slope is small.
constexpr int kFits = 2;

using Vec6d = Eigen::Matrix<double, 6, 1>;
using Mat6d = Eigen::Matrix<double, 6, 6>;

/// Coefficients (c, b_u, b_v, c_uu, c_uv, c_vv) of the quadric in coordinates over the radius. False: ill-conditioned.
bool FitQuadric(std::span<const Vec3f> points, float radius, const Mat3f& frame, Vec6d* quadric) {
  Mat6d matrix = Mat6d::Zero();
  Vec6d right = Vec6d::Zero();
  for (const Vec3f& point : points) {
    const Vec3f p = frame.transpose() * point / radius;
    const float inside = 1.0f - p.squaredNorm();
    if (!(inside > 0.0f)) {
      continue;
    }
    const double u = static_cast<double>(p.x()), v = static_cast<double>(p.y());
    const double weight = static_cast<double>(inside * inside);
    Vec6d row;
    row << 1, u, v, 0.5 * u * u, u * v, 0.5 * v * v;
    for (int i = 0; i < 6; ++i) {
      const double scaled = weight * row[i];
      for (int j = 0; j <= i; ++j) {
        matrix(i, j) += scaled * row[j];
      }
      right[i] += scaled * static_cast<double>(p.z());
    }
  }
  const double total = matrix(0, 0);
  if (!(total > 0.0)) {
    return false;
  }
  const Eigen::LDLT<Mat6d, Eigen::Lower> factor(matrix / total);
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > kLeastPivot)) {
    return false;
  }
  *quadric = factor.solve(right / total);
  return quadric->allFinite();
}

Mat3f FrameOf(const Vec3f& normal) {
  Mat3f frame;
  frame.col(2) = normal;
  frame.col(0) = normal.unitOrthogonal();
  frame.col(1) = normal.cross(frame.col(0));
  return frame;
}

}  // namespace

PrincipalCurvatures FitCurvatures(std::span<const Vec3f> points, float radius, const Vec3f& normal) {
  PrincipalCurvatures none{normal, normal.unitOrthogonal(), 0, 0};
  Mat3f frame = FrameOf(normal);
  Vec6d q;
  for (int i = 0; i < kFits; ++i) {
    if (!FitQuadric(points, radius, frame, &q)) {
      return none;
    }
    if (i + 1 < kFits) {
      frame = FrameOf((frame * Vec3f(static_cast<float>(-q[1]), static_cast<float>(-q[2]), 1.0f)).normalized());
    }
  }
  // The remaining slope is small: shape operator = Hessian over the length of the normal.
  const double scale = -1.0 / (static_cast<double>(radius) * std::sqrt(1.0 + q[1] * q[1] + q[2] * q[2]));
  const double mean = 0.5 * scale * (q[3] + q[5]), half = 0.5 * scale * (q[3] - q[5]), twist = scale * q[4];
  const double apart = std::hypot(half, twist);
  // The direction of the larger eigenvalue is turned by half the angle of (half, twist).
  const double angle = 0.5 * std::atan2(twist, half) + (mean < 0.0 ? 0.5 * M_PI : 0.0);
  const double first = mean < 0.0 ? mean - apart : mean + apart, second = 2 * mean - first;
  PrincipalCurvatures result{frame.col(2), {}, static_cast<float>(first), static_cast<float>(second)};
  result.e1 = static_cast<float>(std::cos(angle)) * frame.col(0) + static_cast<float>(std::sin(angle)) * frame.col(1);
  result.kappa1 = std::clamp(result.kappa1, -kMaxCurvature, kMaxCurvature);
  result.kappa2 = std::clamp(result.kappa2, -kMaxCurvature, kMaxCurvature);
  return std::isfinite(first) && std::isfinite(second) && result.e1.allFinite() ? result : none;
}

PrincipalCurvatures RolledOver(PrincipalCurvatures surface, float ball) {
  for (float* kappa : {&surface.kappa1, &surface.kappa2}) {
    *kappa = std::clamp(*kappa / std::max(1.0f + *kappa * ball, kLeastRolled), -kMaxCurvature, kMaxCurvature);
  }
  return surface;
}

SurfaceCurvature::SurfaceCurvature(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene),
      model_(model),
      particles_(particles),
      first_neighbour_(scene.tube_vertex_count + 1, 0),
      visited_(particles->particle_count(), 0) {
  // Each edge of a closed surface occurs in two triangles, once in each direction.
  for (const Triangle& triangle : scene.tube_surface) {
    for (const Index vertex : triangle) {
      ++first_neighbour_[vertex + 1];
    }
  }
  for (std::size_t i = 1; i < first_neighbour_.size(); ++i) {
    first_neighbour_[i] += first_neighbour_[i - 1];
  }
  neighbours_.resize(first_neighbour_.back());
  std::vector<Index> next(first_neighbour_.begin(), first_neighbour_.end() - 1);
  for (const Triangle& triangle : scene.tube_surface) {
    for (std::size_t i = 0; i < 3; ++i) {
      neighbours_[next[triangle[i]]++] = triangle[(i + 1) % 3];
    }
  }
  found_.reserve(kMaxVertices);
  points_.reserve(kMaxVertices);
}

Vec3f SurfaceCurvature::Place(Index particle, bool at_rest) const {
  return at_rest ? scene_.rest_position[particle] : particles_->At(particles_->Ref(particle));
}

void SurfaceCurvature::Visit(Index particle) {
  if (visited_[particle] != search_ && found_.size() < kMaxVertices) {
    visited_[particle] = search_;
    found_.push_back(particle);
  }
}

void SurfaceCurvature::VisitNeighbours(Index particle) {
  const Index first = scene_.membrane.first;
  if (particle < scene_.tube_vertex_count) {
    for (Index i = first_neighbour_[particle]; i < first_neighbour_[particle + 1]; ++i) {
      Visit(neighbours_[i]);
    }
    return;
  }
  const Index node = particle - first, cols = model_->cols(), row = node / cols, col = node % cols;
  const std::array<Index, 3> step{1, cols, cols + 1};
  for (int direction = 0; direction < 3; ++direction) {
    const Index by = step[static_cast<std::size_t>(direction)];
    if (model_->EdgeAlive(node, direction)) {
      Visit(particle + by);
    }
    const bool before = (direction == 1 || col > 0) && (direction == 0 || row > 0);
    if (before && model_->EdgeAlive(node - by, direction)) {
      Visit(particle - by);
    }
  }
}

PrincipalCurvatures SurfaceCurvature::At(const SurfacePoint& at, bool at_rest, const Vec3f& n) {
  PrincipalCurvatures none{n, n.unitOrthogonal(), 0, 0};
  if (!at.found) {
    return none;
  }
  const Index membrane_triangles = scene_.membrane.triangle_count();
  Triangle corner;
  if (at.on_membrane) {
    corner = model_->TriangleNodes(at.triangle);
    for (Index& particle : corner) {
      particle += scene_.membrane.first;
    }
  } else {
    corner = scene_.tube_surface[at.triangle - membrane_triangles];
  }
  std::array<Vec3f, 3> x, now;
  Vec3f middle = Vec3f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = Place(corner[i], at_rest);
    now[i] = Place(corner[i], false);
    middle += at.closest.barycentric[i] * x[i];
  }
  // The side of the tool follows from the present shape of the triangle.
  const float cosine = n.dot((now[1] - now[0]).cross(now[2] - now[0]).stableNormalized());
  const Vec3f normal = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
  if (!(std::abs(cosine) > kLeastCosine) || normal.isZero()) {
    return none;
  }
  const float longest = std::max({(x[1] - x[0]).norm(), (x[2] - x[1]).norm(), (x[0] - x[2]).norm()});
  const float radius = std::clamp(kRadius, kMinEdges * longest, kMaxEdges * longest);

  if (++search_ == 0) {  // Overflow, once in 2^32 searches: clear the marks of the old ones.
    std::fill(visited_.begin(), visited_.end(), 0);
    search_ = 1;
  }
  found_.clear();
  points_.clear();
  for (const Index particle : corner) {
    Visit(particle);
  }
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const Vec3f offset = Place(found_[i], at_rest) - middle;
    if (offset.squaredNorm() < radius * radius) {
      points_.push_back(offset);
      VisitNeighbours(found_[i]);
    }
  }
  PrincipalCurvatures result = FitCurvatures(points_, radius, std::copysign(1.0f, cosine) * normal);
  result.e1 = Quatf::FromTwoVectors(result.n, n) * result.e1;
  result.n = n;
  return result;
}

}  // namespace fulcrum::physics
