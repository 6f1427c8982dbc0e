#include "tests/numerics/physics/reference/elastic_energy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "physics_node/energy/tet_energy.h"
#include "tests/numerics/physics/reference/slide_energy.h"

namespace fulcrum::physics::reference {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Vector9d = Eigen::Matrix<double, 9, 1>;

/// Adds the block that couples particles a and b, lower triangle only.
void AddBlock(Index a, Index b, const Mat3d& block, Triplets* out) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const auto row = static_cast<int>(3 * a) + i, col = static_cast<int>(3 * b) + j;
      if (row >= col) {
        out->emplace_back(row, col, block(i, j));
      }
    }
  }
}

/// Hessian of a function of a length: `axial` along the unit vector u, `transverse` across it.
Mat3d LengthHessian(const Vec3d& u, double axial, double transverse) {
  return (axial - transverse) * u * u.transpose() + transverse * Mat3d::Identity();
}

Mat3d PatchGradient(const ElasticModel& model, const ElasticPatch& patch, const Points& x) {
  Mat3d F = Mat3d::Zero();
  for (Index k = patch.first_link; k < patch.first_link + patch.link_count; ++k) {
    const ElasticPatchLink& link = model.patch_links[k];
    F.noalias() += x.col(link.v).lazyProduct(link.gradient.transpose());
  }
  return F;
}

/// Forces of springs from particles i to i + offset, on the latter. Separate arrays of x, y and z let the compiler use
/// vectors.
void SpringForces(const double* __restrict__ x, const double* __restrict__ y, const double* __restrict__ z,
                  std::size_t offset, const double* __restrict__ rest, const double* __restrict__ axial,
                  double stiffening, std::size_t count, double* __restrict__ fx, double* __restrict__ fy,
                  double* __restrict__ fz) {
  for (std::size_t i = 0; i < count; ++i) {
    const double dx = x[i + offset] - x[i], dy = y[i + offset] - y[i], dz = z[i + offset] - z[i];
    const double length = std::sqrt(dx * dx + dy * dy + dz * dz);
    const double e = length / rest[i] - 1;
    // An edge without length has no direction and exerts no force.
    const double scale = axial[i] * e * (1 + stiffening * e * e) / (length + 1e-100);
    fx[i] = scale * dx;
    fy[i] = scale * dy;
    fz[i] = scale * dz;
  }
}

/// d2 Psi / dF2, with the columns of F stacked.
Matrix9d PatchHessian(const Mat3d& F, double mu, double lambda_lame, bool positive) {
  const double pressure = (lambda_lame + mu) * (F.determinant() - 1) - mu;
  const Mat3d cofactor = Cofactor(F);
  const Eigen::Map<const Vector9d> c(cofactor.data());
  const auto cross = [](const Vec3d& v) {
    Mat3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
  };
  // d cof(F) / dF: the cofactor's columns are the cross products of F's.
  Matrix9d turn = Matrix9d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    turn.block<3, 3>(3 * k, 3 * i) = -cross(F.col(j));
    turn.block<3, 3>(3 * k, 3 * j) = cross(F.col(i));
  }
  Matrix9d H = mu * Matrix9d::Identity() + (lambda_lame + mu) * c * c.transpose() + pressure * turn;
  if (positive) {
    const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(H);
    H = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * eigen.eigenvectors().transpose();
  }
  return H;
}

}  // namespace

Points RestPoints(const ElasticModel& model) {
  Points x(3, static_cast<Eigen::Index>(model.rest_position.size()));
  for (Eigen::Index p = 0; p < x.cols(); ++p) {
    x.col(p) = model.rest_position[static_cast<std::size_t>(p)];
  }
  return x;
}

ElasticEnergy::ElasticEnergy(ElasticModel model) : model_(std::move(model)), triangles_of_(TrianglesOfEdges(model_)) {
  model_.hinges.insert(model_.hinges.end(), model_.attachments.begin(), model_.attachments.end());
  for (const ElasticSpring& spring : model_.springs) {
    whole_axial_.push_back(spring.axial);
  }
  BuildRuns();
  for (std::size_t edge = 0; edge < model_.springs.size() && !model_.triangles.empty(); ++edge) {
    RefreshSpring(edge);
  }
}

void ElasticEnergy::BuildRuns() {
  std::vector<std::size_t> order;
  for (std::size_t s = 0; s < model_.springs.size(); ++s) {
    if (model_.springs[s].axial > 0) {
      order.push_back(s);
    }
  }
  const auto offset = [&](std::size_t s) { return model_.springs[s].b - model_.springs[s].a; };
  std::sort(order.begin(), order.end(), [&](std::size_t p, std::size_t q) {
    return std::tuple(offset(p), model_.springs[p].a, p) < std::tuple(offset(q), model_.springs[q].a, q);
  });
  place_.assign(model_.springs.size(), order.size());
  for (const std::size_t s : order) {
    const ElasticSpring& spring = model_.springs[s];
    if (runs_.empty() || runs_.back().offset != offset(s) || runs_.back().first + runs_.back().count != spring.a) {
      runs_.push_back({spring.a, offset(s), rest_length_.size(), 0});
    }
    ++runs_.back().count;
    place_[s] = rest_length_.size();
    rest_length_.push_back(spring.rest_length);
    axial_.push_back(spring.axial);
  }
  std::size_t longest = 0;
  for (const SpringRun& run : runs_) {
    longest = std::max(longest, run.count);
  }
  spring_force_.resize(3 * longest);
  plane_.resize(6 * static_cast<std::size_t>(particle_count()));
}

void ElasticEnergy::RefreshSpring(std::size_t edge) {
  const double axial = whole_axial_[edge] * ShareOfSprings(model_, triangles_of_[edge]);
  model_.springs[edge].axial = axial;
  if (place_[edge] < axial_.size()) {
    axial_[place_[edge]] = axial;
  }
}

void ElasticEnergy::CutEdge(std::size_t edge) {
  whole_axial_[edge] = 0;
  for (const std::size_t t : triangles_of_[edge]) {
    model_.triangles[t].rest = {};
    for (const std::size_t other : model_.triangles[t].edges) {
      RefreshSpring(other);
    }
  }
  RefreshSpring(edge);
}

Vec3d ElasticEnergy::Along(std::size_t edge, const Points& x) const {
  return x.col(model_.springs[edge].b) - x.col(model_.springs[edge].a);
}

TriangleTerms ElasticEnergy::TermsOf(const ElasticTriangle& triangle, const Points& x,
                                     TriangleCoupling coupling) const {
  std::array<double, 3> squares{};
  for (std::size_t i = 0; i < 3; ++i) {
    squares[i] = Along(triangle.edges[i], x).squaredNorm();
  }
  return EvaluateTriangle(triangle.rest, model_.triangle_stiffening(), squares, coupling);
}

void ElasticEnergy::TriangleGradient(const Points& x, Points* gradient) const {
  for (const ElasticTriangle& triangle : model_.triangles) {
    if (triangle.rest.stiffness > 0) {
      const TriangleTerms terms = TermsOf(triangle, x, TriangleCoupling::kForce);
      for (std::size_t i = 0; i < 3; ++i) {
        const ElasticSpring& edge = model_.springs[triangle.edges[i]];
        const Vec3d force = terms.tension[static_cast<Eigen::Index>(i)] * Along(triangle.edges[i], x);
        gradient->col(edge.a) -= force;
        gradient->col(edge.b) += force;
      }
    }
  }
}

double ElasticEnergy::Energy(const Points& x) const {
  double energy = 0;
  for (const ElasticSpring& s : model_.springs) {
    if (s.axial > 0) {
      const double e = (x.col(s.b) - x.col(s.a)).norm() / s.rest_length - 1;
      energy += s.axial * s.rest_length * (e * e / 2 + model_.spring_stiffening() * e * e * e * e / 4);
    }
  }
  for (const ElasticTriangle& triangle : model_.triangles) {
    if (triangle.rest.stiffness > 0) {
      energy += TermsOf(triangle, x, TriangleCoupling::kForce).energy;
    }
  }
  for (const ElasticHinge& h : model_.hinges) {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      sum += h.c[i] * (x.col(h.v[i]) - model_.rest_position[h.v[i]]);
    }
    energy += h.stiffness / 2 * sum.squaredNorm();
  }
  double organ = 0;
  for (const ElasticPatch& patch : model_.patches) {
    const Mat3d F = PatchGradient(model_, patch, x);
    // The shear links contribute a mu/2 |F|^2, which is 3 a mu/2 per volume at rest; the patches subtract it.
    organ += patch.volume *
             (TetEnergy(F, model_.mu_Pa, model_.lambda_Pa) - patch.variance * model_.mu_Pa / 2 * F.squaredNorm());
  }
  for (const ElasticShearLink& link : model_.shear_links) {
    organ += link.stiffness / 2 * (x.col(link.a) - x.col(link.b)).squaredNorm();
  }
  energy += organ;
  for (const ElasticBinding& b : model_.bindings) {
    const Vec3d foot = b.barycentric[0] * x.col(b.surface[0]) + b.barycentric[1] * x.col(b.surface[1]) +
                       b.barycentric[2] * x.col(b.surface[2]);
    const double stretch = (x.col(b.membrane) - foot).norm() - b.rest_length;
    energy += b.stiffness / 2 * stretch * stretch;
  }
  energy += SlideEnergy(model_, x);
  for (Eigen::Index p = 0; p < particle_count(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    energy -= model_.mass[i] * model_.gravity.dot(x.col(p));
    if (!model_.load.empty()) {
      energy -= model_.load[i].dot(x.col(p) - model_.rest_position[i]);
    }
  }
  return energy;
}

void ElasticEnergy::SpringGradient(const Points& x, Points* gradient) const {
  // Planes: x y z of the positions, then of the gradient.
  const auto n = static_cast<std::size_t>(particle_count());
  double* const p[3] = {plane_.data(), plane_.data() + n, plane_.data() + 2 * n};
  double* const g[3] = {plane_.data() + 3 * n, plane_.data() + 4 * n, plane_.data() + 5 * n};
  for (std::size_t i = 0; i < n; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      p[axis][i] = x(axis, static_cast<Eigen::Index>(i));
    }
  }
  std::fill(plane_.begin() + static_cast<std::ptrdiff_t>(3 * n), plane_.end(), 0.0);
  for (const SpringRun& run : runs_) {
    double* const f = spring_force_.data();
    SpringForces(p[0] + run.first, p[1] + run.first, p[2] + run.first, run.offset, rest_length_.data() + run.begin,
                 axial_.data() + run.begin, model_.spring_stiffening(), run.count, f, f + run.count, f + 2 * run.count);
    for (int axis = 0; axis < 3; ++axis) {
      double* __restrict__ tail = g[axis] + run.first;
      const double* __restrict__ force = spring_force_.data() + static_cast<std::size_t>(axis) * run.count;
      for (std::size_t i = 0; i < run.count; ++i) {
        tail[i] -= force[i];
      }
      double* __restrict__ head = g[axis] + run.first + run.offset;
      for (std::size_t i = 0; i < run.count; ++i) {
        head[i] += force[i];
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      (*gradient)(axis, static_cast<Eigen::Index>(i)) = g[axis][i];
    }
  }
}

void ElasticEnergy::OrganGradient(const Points& x, Points* gradient) const {
  for (const ElasticPatch& patch : model_.patches) {
    const Mat3d F = PatchGradient(model_, patch, x);
    const Mat3d P = patch.volume * (TetStress(F, model_.mu_Pa, model_.lambda_Pa) - patch.variance * model_.mu_Pa * F);
    for (Index k = patch.first_link; k < patch.first_link + patch.link_count; ++k) {
      gradient->col(model_.patch_links[k].v).noalias() += P.lazyProduct(model_.patch_links[k].gradient);
    }
  }
  for (const ElasticShearLink& link : model_.shear_links) {
    const Vec3d force = link.stiffness * (x.col(link.a) - x.col(link.b));
    gradient->col(link.a) += force;
    gradient->col(link.b) -= force;
  }
}

void ElasticEnergy::Gradient(const Points& x, Points* gradient) const {
  gradient->resize(3, x.cols());
  SpringGradient(x, gradient);
  TriangleGradient(x, gradient);
  for (const ElasticHinge& h : model_.hinges) {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      sum += h.c[i] * (x.col(h.v[i]) - model_.rest_position[h.v[i]]);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      gradient->col(h.v[i]) += h.stiffness * h.c[i] * sum;
    }
  }
  OrganGradient(x, gradient);
  for (const ElasticBinding& b : model_.bindings) {
    const Vec3d foot = b.barycentric[0] * x.col(b.surface[0]) + b.barycentric[1] * x.col(b.surface[1]) +
                       b.barycentric[2] * x.col(b.surface[2]);
    const Vec3d d = x.col(b.membrane) - foot;
    const double length = std::max(d.norm(), 1e-12);
    const Vec3d force = b.stiffness * (length - b.rest_length) / length * d;
    gradient->col(b.membrane) += force;
    for (std::size_t i = 0; i < 3; ++i) {
      gradient->col(b.surface[i]) -= b.barycentric[i] * force;
    }
  }
  AddSlideGradient(model_, x, gradient);
  if (!model_.gravity.isZero()) {
    for (Eigen::Index p = 0; p < particle_count(); ++p) {
      gradient->col(p) -= model_.mass[static_cast<std::size_t>(p)] * model_.gravity;
    }
  }
  for (std::size_t p = 0; p < model_.load.size(); ++p) {
    gradient->col(static_cast<Eigen::Index>(p)) -= model_.load[p];
  }
}

SparseMatrix ElasticEnergy::Hessian(const Points& x, bool positive) const {
  Triplets out;
  out.reserve(24 * model_.springs.size() + 78 * model_.hinges.size() + 78 * model_.bindings.size() +
              50 * model_.patch_links.size());
  for (const ElasticSpring& s : model_.springs) {
    if (!(s.axial > 0)) {
      continue;
    }
    const Vec3d d = x.col(s.b) - x.col(s.a);
    const double length = std::max(d.norm(), 1e-12), e = length / s.rest_length - 1;
    const double tension = s.axial * e * (1 + model_.spring_stiffening() * e * e);
    const double along = s.axial * (1 + 3 * model_.spring_stiffening() * e * e) / s.rest_length;
    const double across = positive ? std::max(tension, 0.0) / length : tension / length;
    const Mat3d H = LengthHessian(d / length, along, across);
    AddBlock(s.a, s.a, H, &out);
    AddBlock(s.b, s.b, H, &out);
    AddBlock(std::max(s.a, s.b), std::min(s.a, s.b), -H, &out);
  }
  for (const ElasticTriangle& triangle : model_.triangles) {
    if (triangle.rest.stiffness > 0) {
      const TriangleTerms terms = TermsOf(triangle, x, positive ? TriangleCoupling::kBound : TriangleCoupling::kExact);
      // Each edge's ends, and what moving an end does to the edge.
      for (std::size_t i = 0; i < 3; ++i) {
        const ElasticSpring& p = model_.springs[triangle.edges[i]];
        const Vec3d along = Along(triangle.edges[i], x);
        for (std::size_t j = 0; j < 3; ++j) {
          const auto ii = static_cast<Eigen::Index>(i), jj = static_cast<Eigen::Index>(j);
          const ElasticSpring& q = model_.springs[triangle.edges[j]];
          Mat3d block = terms.coupling(ii, jj) * along * Along(triangle.edges[j], x).transpose();
          if (i == j) {
            block += (positive ? std::max(terms.tension[ii], 0.0) : terms.tension[ii]) * Mat3d::Identity();
          }
          AddBlock(p.a, q.a, block, &out);
          AddBlock(p.b, q.b, block, &out);
          AddBlock(p.a, q.b, -block, &out);
          AddBlock(p.b, q.a, -block, &out);
        }
      }
    }
  }
  for (const ElasticHinge& h : model_.hinges) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        AddBlock(h.v[i], h.v[j], h.stiffness * h.c[i] * h.c[j] * Mat3d::Identity(), &out);
      }
    }
  }
  for (const ElasticPatch& patch : model_.patches) {
    const Matrix9d H =
        patch.volume * PatchHessian(PatchGradient(model_, patch, x), model_.mu_Pa, model_.lambda_Pa, positive);
    const double variance = patch.volume * patch.variance * model_.mu_Pa;
    for (Index k = patch.first_link; k < patch.first_link + patch.link_count; ++k) {
      const ElasticPatchLink& p = model_.patch_links[k];
      Eigen::Matrix<double, 9, 3> column = Eigen::Matrix<double, 9, 3>::Zero();
      for (int c = 0; c < 3; ++c) {
        column += H.middleCols<3>(3 * c) * p.gradient[c];
      }
      for (Index l = patch.first_link; l < patch.first_link + patch.link_count; ++l) {
        const ElasticPatchLink& q = model_.patch_links[l];
        if (q.v < p.v) {
          continue;
        }
        Mat3d block = -variance * p.gradient.dot(q.gradient) * Mat3d::Identity();
        for (int r = 0; r < 3; ++r) {
          block += q.gradient[r] * column.middleRows<3>(3 * r);
        }
        AddBlock(q.v, p.v, block, &out);
      }
    }
  }
  for (const ElasticShearLink& link : model_.shear_links) {
    const Mat3d H = link.stiffness * Mat3d::Identity();
    AddBlock(link.a, link.a, H, &out);
    AddBlock(link.b, link.b, H, &out);
    AddBlock(link.b, link.a, -H, &out);
  }
  for (const ElasticBinding& b : model_.bindings) {
    const std::array<Index, 4> v{b.membrane, b.surface[0], b.surface[1], b.surface[2]};
    const std::array<double, 4> c{1, -b.barycentric[0], -b.barycentric[1], -b.barycentric[2]};
    Vec3d d = Vec3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      d += c[i] * x.col(v[i]);
    }
    const double length = std::max(d.norm(), 1e-12), tension = b.stiffness * (length - b.rest_length);
    const Mat3d H = LengthHessian(d / length, b.stiffness, (positive ? std::max(tension, 0.0) : tension) / length);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        AddBlock(v[i], v[j], c[i] * c[j] * H, &out);
      }
    }
  }
  for (const ElasticSlide& slide : model_.slides) {
    const SlideFoot foot = FootOf(model_, slide, x);
    const Mat3d block = slide.stiffness * foot.normal * foot.normal.transpose();
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) AddBlock(foot.v[i], foot.v[j], foot.c[i] * foot.c[j] * block, &out);
    }
  }
  SparseMatrix H(3 * particle_count(), 3 * particle_count());
  H.setFromTriplets(out.begin(), out.end());
  return H;
}

double KineticEnergy(const ElasticModel& model, const Points& velocity) {
  double energy = 0;
  for (Eigen::Index p = 0; p < velocity.cols(); ++p) {
    energy += model.mass[static_cast<std::size_t>(p)] / 2 * velocity.col(p).squaredNorm();
  }
  return energy;
}

double TetVolume(const ElasticTet& tet, const Points& x) {
  const Vec3d a = x.col(tet.v[1]) - x.col(tet.v[0]), b = x.col(tet.v[2]) - x.col(tet.v[0]);
  return a.cross(b).dot(x.col(tet.v[3]) - x.col(tet.v[0])) / 6;
}

double OrganVolume(const ElasticModel& model, const Points& x) {
  double volume = 0;
  for (const ElasticTet& tet : model.tets) {
    volume += TetVolume(tet, x);
  }
  return volume;
}

int InvertedTets(const ElasticModel& model, const Points& x) {
  int inverted = 0;
  for (const ElasticTet& tet : model.tets) {
    inverted += !(TetVolume(tet, x) > 0);
  }
  return inverted;
}

}  // namespace fulcrum::physics::reference
