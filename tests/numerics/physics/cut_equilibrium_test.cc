// Where mode accurate comes to rest the reference energy is in equilibrium, with cuts: what the solver packs of
// triangles, and of the springs that opened triangles leave, is that energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "services/scene/builder/build.h"
#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/reference/elastic_energy.h"

namespace fulcrum::physics {
namespace {

class CutEquilibrium : public testing::TestWithParam<MembraneModel> {};

TEST_P(CutEquilibrium, IsThatOfTheReference) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  SceneView scene = data.View();
  scene.physics.membrane_model = GetParam();
  scene.physics.membrane_bending_Nm = 0;  // A cut also takes the hinges over it, which the reference keeps.
  scene.physics.preset = PhysicsPreset::kReference;
  scene.physics.damping_per_s = 60;
  const Index rows = scene.membrane.rows, cols = scene.membrane.cols, first = scene.membrane.first;
  std::vector<Index> held;
  for (Index r = rows / 2 - 2; r <= rows / 2 + 2; ++r) {
    held.push_back(first + r * cols + cols / 2);
  }
  // A slit beside the held nodes, and single edges of every direction that lie far apart.
  std::vector<std::size_t> cut;
  for (Index r = rows / 2 - 6; r < rows / 2 + 6; ++r) {
    cut.push_back(3 * (r * cols + cols / 2 + 3));
    cut.push_back(3 * (r * cols + cols / 2 + 3) + 2);
  }
  std::mt19937 random(3);
  for (Index r = 4; r + 4 < rows; r += 5) {
    for (Index c = 3; c < cols / 2 - 2; c += 4) {
      cut.push_back(3 * (r * cols + c) + random() % 3);
    }
  }
  AccurateUnderTest solver(scene);
  solver.Hold(held);
  solver.CutEdges(cut);
  std::vector<Vec3f> places;
  for (const Index p : held) {
    places.push_back(scene.rest_position[p]);
  }
  for (int step = 0; step < 600; ++step) {
    for (Vec3f& place : places) {
      place.z() += step < 50 ? 0.00016f : 0.0f;
    }
    solver.MoveHeld(places);
    solver.Step();
  }
  reference::ElasticEnergy energy(BuildElasticModel(scene));
  for (const std::size_t edge : cut) {
    energy.CutEdge(edge);
  }
  Eigen::Matrix3Xf xyz(3, energy.particle_count());
  solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
  reference::Points gradient;
  energy.Gradient(xyz.cast<double>(), &gradient);
  double pulled = 0, left = 0;
  for (Index p = 0; p < scene.rest_position.size(); ++p) {
    const double force = gradient.col(p).norm();
    if (std::find(held.begin(), held.end(), p) != held.end()) {
      pulled += force;
    } else if (scene.inverse_mass[p] > 0) {
      left = std::max(left, force);
    }
  }
  EXPECT_GT(pulled, 0.1) << "N";
  EXPECT_LT(left, 0.001 * pulled) << "N on a free particle";
}

INSTANTIATE_TEST_SUITE_P(Models, CutEquilibrium, testing::Values(MembraneModel::kSprings, MembraneModel::kContinuum),
                         [](const auto& model) {
                           return std::string(model.param == MembraneModel::kSprings ? "Springs" : "Continuum");
                         });

}  // namespace
}  // namespace fulcrum::physics
