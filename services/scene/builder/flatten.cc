#include "services/scene/builder/flatten.h"

#include <Eigen/SparseCholesky>
#include <array>
#include <cmath>

namespace fulcrum::scene {
namespace {

using Eigen::Vector2d;

constexpr int kIterations = 30;  ///< Sufficient for the residual distortion to settle to 1e-4 on every shipped scene.

/// A triangle flattened on its own: corners in a frame of its own, and the cotangent opposite to each edge (k, k+1).
struct FlatTriangle {
  std::array<int, 3> v;
  std::array<Vector2d, 3> x;
  std::array<double, 3> cot;
};

std::vector<FlatTriangle> LayFlat(int rows, int cols, const std::vector<Vec3d>& sheet) {
  std::vector<FlatTriangle> triangles;
  triangles.reserve(2 * static_cast<std::size_t>(rows - 1) * (cols - 1));
  const auto add = [&](int a, int b, int c) {
    const Vec3d ab = sheet[b] - sheet[a], ac = sheet[c] - sheet[a];
    const double length = ab.norm(), height = ab.cross(ac).norm() / length;
    FlatTriangle t{{a, b, c}, {Vector2d(0, 0), Vector2d(length, 0), Vector2d(ab.dot(ac) / length, height)}, {}};
    for (int k = 0; k < 3; ++k) {
      const Vector2d &o = t.x[(k + 2) % 3], p = t.x[k] - o, q = t.x[(k + 1) % 3] - o;
      t.cot[k] = p.dot(q) / (p.x() * q.y() - p.y() * q.x());
    }
    triangles.push_back(t);
  };
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < cols; ++c) {
      const int n00 = r * cols + c, n10 = n00 + cols;
      add(n00, n00 + 1, n10 + 1);
      add(n00, n10 + 1, n10);
    }
  }
  return triangles;
}

/// First guess: arc length along each row from its middle, and along each column from its middle.
std::vector<Vector2d> ArcLengths(int rows, int cols, const std::vector<Vec3d>& sheet) {
  std::vector<Vector2d> flat(sheet.size(), Vector2d::Zero());
  for (int r = 0; r < rows; ++r) {
    const int row = r * cols;
    for (int c = 1; c < cols; ++c) {
      flat[row + c].x() = flat[row + c - 1].x() + (sheet[row + c] - sheet[row + c - 1]).norm();
    }
    const double middle = flat[row + cols / 2].x();
    for (int c = 0; c < cols; ++c) {
      flat[row + c].x() -= middle;
    }
  }
  for (int c = 0; c < cols; ++c) {
    for (int r = 1; r < rows; ++r) {
      flat[r * cols + c].y() = flat[(r - 1) * cols + c].y() + (sheet[r * cols + c] - sheet[(r - 1) * cols + c]).norm();
    }
    const double middle = flat[rows / 2 * cols + c].y();
    for (int r = 0; r < rows; ++r) {
      flat[r * cols + c].y() -= middle;
    }
  }
  return flat;
}

/// Turns the sheet so that its middle row lies along s, and moves it to the origin.
void Align(int rows, int cols, std::vector<Vector2d>* flat) {
  const int row = rows / 2 * cols;
  const Vector2d along = ((*flat)[row + cols - 1] - (*flat)[row]).normalized();
  Vector2d low = Vector2d::Constant(1e30);
  for (Vector2d& p : *flat) {
    p = Vector2d(along.dot(p), along.x() * p.y() - along.y() * p.x());
    low = low.cwiseMin(p);
  }
  for (Vector2d& p : *flat) {
    p -= low;
  }
}

}  // namespace

std::vector<Vector2d> FlattenSheet(int rows, int cols, const std::vector<Vec3d>& sheet) {
  const std::vector<FlatTriangle> triangles = LayFlat(rows, cols, sheet);
  std::vector<Vector2d> flat = ArcLengths(rows, cols, sheet);
  const auto n = static_cast<int>(sheet.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(12 * triangles.size() + 1);
  double scale = 0;
  for (const FlatTriangle& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const int i = t.v[k], j = t.v[(k + 1) % 3];
      entries.emplace_back(i, i, t.cot[k]);
      entries.emplace_back(j, j, t.cot[k]);
      entries.emplace_back(i, j, -t.cot[k]);
      entries.emplace_back(j, i, -t.cot[k]);
      scale += std::abs(t.cot[k]);
    }
  }
  // The Laplacian does not determine a translation: a spring of average stiffness holds the first node.
  const double anchor = scale / n;
  entries.emplace_back(0, 0, anchor);
  Eigen::SparseMatrix<double> laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian);

  Eigen::MatrixX2d right(n, 2);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    right.setZero();
    right.row(0) = anchor * flat[0].transpose();
    for (const FlatTriangle& t : triangles) {
      // Best rotation (c, s) of the triangle: of sum cot (u_ij)(x_ij)^T, in two dimensions in closed form.
      double c = 0, s = 0;
      for (int k = 0; k < 3; ++k) {
        const Vector2d u = flat[t.v[k]] - flat[t.v[(k + 1) % 3]], x = t.x[k] - t.x[(k + 1) % 3];
        c += t.cot[k] * u.dot(x);
        s += t.cot[k] * (x.x() * u.y() - x.y() * u.x());
      }
      const double length = std::hypot(c, s);
      c /= length;
      s /= length;
      for (int k = 0; k < 3; ++k) {
        const Vector2d x = t.x[k] - t.x[(k + 1) % 3];
        const Vector2d wanted = t.cot[k] * Vector2d(c * x.x() - s * x.y(), s * x.x() + c * x.y());
        right.row(t.v[k]) += wanted.transpose();
        right.row(t.v[(k + 1) % 3]) -= wanted.transpose();
      }
    }
    const Eigen::MatrixX2d solution = solver.solve(right);
    for (int i = 0; i < n; ++i) {
      flat[i] = solution.row(i).transpose();
    }
  }
  Align(rows, cols, &flat);
  return flat;
}

}  // namespace fulcrum::scene
