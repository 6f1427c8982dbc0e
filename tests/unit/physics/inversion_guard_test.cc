// The guard against inverted tetrahedra: it has no effect on sound tissue; its force is the gradient of its energy, its
// matrix never below the second derivative.
#include "physics_node/implicit/inversion_guard.h"

#include <gtest/gtest.h>

#include <random>

namespace fulcrum::physics {
namespace {

using implicit::InversionGuard;

constexpr std::size_t kVertices = 5;
/// Millimetres: the size of the organ's tetrahedra.
constexpr double kSize_m = 0.003;

/// Two tetrahedra that share a face.
ElasticModel TwoTets() {
  ElasticModel model;
  model.rest_position = {{0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0.1}, {0.1, 0.2, 1}, {1, 1.2, 1.1}};
  for (Vec3d& x : model.rest_position) {
    x *= kSize_m;
  }
  model.mu_Pa = 3e4;
  for (const Tetrahedron& v : {Tetrahedron{0, 1, 2, 3}, Tetrahedron{1, 4, 2, 3}}) {
    Mat3d edges;
    for (std::size_t k = 1; k < 4; ++k) {
      edges.col(static_cast<Eigen::Index>(k) - 1) = model.rest_position[v[k]] - model.rest_position[v[0]];
    }
    EXPECT_GT(edges.determinant(), 0.0);
    model.tets.push_back({v, edges.determinant() / 6, edges.inverse()});
  }
  return model;
}

using Field = std::array<float, 4 * kVertices>;

Field Places(const ElasticModel& model) {
  Field field{};
  for (std::size_t v = 0; v < kVertices; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      field[4 * v + axis] = static_cast<float>(model.rest_position[v][static_cast<Eigen::Index>(axis)]);
    }
  }
  return field;
}
Field Along(const Field& from, const Field& direction, float by) {
  Field field = from;
  for (std::size_t i = 0; i < field.size(); ++i) {
    field[i] += by * direction[i];
  }
  return field;
}

TEST(InversionGuard, LeavesSoundTissueAlone) {
  const ElasticModel model = TwoTets();
  InversionGuard guard(model);
  Field place = Places(model);
  for (std::size_t v = 0; v < kVertices; ++v) {
    place[4 * v] *= 3;  // Stretched and flattened, but not inverted.
    place[4 * v + 2] *= 0.1f;
  }
  guard.Linearise(place.data());
  EXPECT_TRUE(guard.folded().empty());
  EXPECT_EQ(guard.Energy(place.data()), 0.0);
}

TEST(InversionGuard, ForceIsTheGradientAndTheMatrixNeverTooSmall) {
  const ElasticModel model = TwoTets();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    InversionGuard guard(model);
    Field place = Places(model), direction{};
    for (std::size_t v = 0; v < kVertices; ++v) {
      place[4 * v + 1] *= -1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        place[4 * v + axis] += 0.3f * static_cast<float>(kSize_m) * any(random);
        direction[4 * v + axis] = any(random);
      }
    }
    for (int look = 0; look < 2; ++look) {
      guard.Linearise(place.data());
    }
    ASSERT_FALSE(guard.folded().empty());
    Field residual{}, product{};
    guard.AddForce(residual.data());
    const double curvature = guard.Apply(direction.data(), 1.0f, product.data());
    double pull = 0, power = 0;
    for (std::size_t i = 0; i < residual.size(); ++i) {
      pull += static_cast<double>(residual[i] * direction[i]);
      power += static_cast<double>(product[i] * direction[i]);
    }
    EXPECT_NEAR(power, curvature, 1e-4 * curvature);
    // Large against rounding, small against the change that flips the nearest rotation where two are almost equally
    // near.
    constexpr double kStep_m = 3e-6;
    const double back = guard.Energy(Along(place, direction, -kStep_m).data()),
                 ahead = guard.Energy(Along(place, direction, kStep_m).data()), here = guard.Energy(place.data());
    EXPECT_NEAR(-(ahead - back) / (2 * kStep_m), pull, 1e-3 * std::sqrt(2 * here * curvature)) << "trial " << trial;
    EXPECT_LE(ahead - here + kStep_m * pull, curvature * kStep_m * kStep_m / 2 + 1e-5 * here) << "trial " << trial;
  }
}

TEST(InversionGuard, LetsGoOfWhatIsBackInShape) {
  const ElasticModel model = TwoTets();
  InversionGuard guard(model);
  Field place = Places(model);
  place[4 * 0 + 1] = place[4 * 0 + 2] = place[4 * 0] = static_cast<float>(kSize_m);  // Moved through the opposite face.
  for (int look = 0; look < 2; ++look) {
    guard.Linearise(place.data());
  }
  EXPECT_FALSE(guard.folded().empty());
  guard.Linearise(Places(model).data());
  EXPECT_TRUE(guard.folded().empty());
}

}  // namespace
}  // namespace fulcrum::physics
