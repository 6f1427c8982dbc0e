// Gradients against finite differences, and properties of one projection.
#include "physics_node/tissue/constraints.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace fulcrum::physics {
namespace {

using Vec = V3<double>;
template <int N>
using Points = std::array<Vec, N>;

template <int N>
Points<N> RandomPoints(std::mt19937* random, double size) {
  std::uniform_real_distribution<double> coordinate(-size, size);
  Points<N> x;
  for (Vec& p : x) {
    p = Vec(coordinate(*random), coordinate(*random), coordinate(*random));
  }
  return x;
}

/// Largest deviation of the gradient from central differences, relative to the gradient.
template <int N>
double GradientError(const std::function<Evaluated<double, N>(const Points<N>&)>& constraint, const Points<N>& x) {
  constexpr double kStep = 1e-7;  // Coordinates are of order 1: truncation 1e-14, cancellation 1e-9.
  const auto at = constraint(x);
  double largest = 0, size = 0;
  for (int i = 0; i < N; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      Points<N> low = x, high = x;
      low[i][axis] -= kStep;
      high[i][axis] += kStep;
      const double difference = (constraint(high).value - constraint(low).value) / (2 * kStep);
      largest = std::max(largest, std::abs(difference - at.gradient[i][axis]));
    }
    size = std::max(size, at.gradient[i].norm());
  }
  return largest / size;
}

template <int N>
void ExpectSound(const std::function<Evaluated<double, N>(const Points<N>&)>& constraint, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> mass(0.1, 3.0);
  for (int trial = 0; trial < 200; ++trial) {
    Points<N> x = RandomPoints<N>(&random, 1.0);
    const auto before = constraint(x);
    EXPECT_LT(GradientError<N>(constraint, x), 1e-5) << "trial " << trial;

    // No constraint depends on a common translation, so the gradients cancel.
    Vec sum = Vec::Zero();
    for (const Vec& g : before.gradient) {
      sum += g;
    }
    EXPECT_LT(sum.norm(), 1e-9 * (1.0 + before.gradient[0].norm()));

    // One projection with k = 1 solves C + grad C . dx = 0 and preserves the centre of mass.
    std::array<double, N> w;
    for (double& wi : w) {
      wi = mass(random);
    }
    Points<N> moved = x;
    Project<double, N>(before, w, 1.0, &moved);
    double linearised = before.value;
    Vec momentum = Vec::Zero();
    for (int i = 0; i < N; ++i) {
      linearised += before.gradient[i].dot(moved[i] - x[i]);
      momentum += (moved[i] - x[i]) / w[i];
    }
    EXPECT_NEAR(linearised, 0.0, 1e-9 * (1.0 + std::abs(before.value)));
    EXPECT_LT(momentum.norm(), 1e-8 * (1.0 + std::abs(before.value)) / before.gradient[0].norm() * 10);
  }
}

TEST(Constraints, StretchIsSound) {
  ExpectSound<2>([](const Points<2>& x) { return Stretch<double>(x[0], x[1], 0.7); }, 1);
}

TEST(Constraints, VolumeIsSound) {
  ExpectSound<4>([](const Points<4>& x) { return Volume<double>(x, 0.3); }, 2);
}

TEST(Constraints, BendingIsSound) {
  // The wrapped value jumps at an angle of pi from rest; a rest angle of 0 keeps random hinges away from the jump.
  ExpectSound<4>([](const Points<4>& x) { return Bending<double>(x, 0.0); }, 3);
}

TEST(Constraints, BindingIsSound) {
  ExpectSound<4>([](const Points<4>& x) { return Bind<double>(x, {0.2, 0.5, 0.3}, 0.4); }, 4);
}

Points<4> Hinge(double fold) {
  return {Vec(0, 0, 0), Vec(1, 0, 0), Vec(0.5, 1, 0), Vec(0.5, -std::cos(fold), std::sin(fold))};
}

TEST(Bending, IsZeroOnAFlatHingeAndSmoothThroughIt) {
  EXPECT_NEAR(Bending<double>(Hinge(0.0), 0.0).value, 0.0, 1e-15);
  const std::function<Evaluated<double, 4>(const Points<4>&)> bending = [](const Points<4>& x) {
    return Bending<double>(x, 0.0);
  };
  // At these angles acos(n1 . n2) has no derivative.
  EXPECT_LT(GradientError<4>(bending, Hinge(0.0)), 1e-6);
  EXPECT_LT(GradientError<4>(bending, Hinge(1e-6)), 1e-6);
}

TEST(Bending, TellsUpFromDown) {
  const double up = Bending<double>(Hinge(0.3), 0.0).value, down = Bending<double>(Hinge(-0.3), 0.0).value;
  EXPECT_NEAR(up, -down, 1e-12);
  EXPECT_NEAR(std::abs(up), 0.3, 1e-12);
}

TEST(Bending, HasTheSignOfTheScene) {
  // services/base/core/scene_view.h: from n1 = (x1-x0) x (x2-x0) to n2 = (x3-x0) x (x1-x0) about x1 - x0.
  const Points<4> x = Hinge(0.4);
  const Vec n1 = (x[1] - x[0]).cross(x[2] - x[0]), n2 = (x[3] - x[0]).cross(x[1] - x[0]);
  const double angle = std::atan2(n1.cross(n2).dot((x[1] - x[0]).normalized()), n1.dot(n2));
  EXPECT_NEAR(Bending<double>(x, 0.0).value, angle, 1e-12);
}

TEST(Bending, ProjectionsReachTheRestAngle) {
  Points<4> x = Hinge(0.8);
  for (int i = 0; i < 30; ++i) {
    Project<double, 4>(Bending<double>(x, 0.1), {1, 1, 1, 1}, 1.0, &x);
  }
  EXPECT_NEAR(Bending<double>(x, 0.1).value, 0.0, 1e-9);
}

TEST(Constraints, FixedParticlesStay) {
  Points<2> x{Vec(0, 0, 0), Vec(1, 0, 0)};
  Project<double, 2>(Stretch<double>(x[0], x[1], 0.5), {0.0, 2.0}, 1.0, &x);
  EXPECT_EQ(x[0], Vec(0, 0, 0));
  EXPECT_NEAR((x[1] - x[0]).norm(), 0.5, 1e-12);
  const Points<2> before = x;
  Project<double, 2>(Stretch<double>(x[0], x[1], 0.1), {0.0, 0.0}, 1.0, &x);
  EXPECT_EQ(x[1], before[1]);
}

}  // namespace
}  // namespace fulcrum::physics
