// Adapter of the paper's mode to the test interface.
#pragma once

#include "physics_node/pbd/pbd_solver.h"
#include "tests/numerics/physics/store_solver.h"

namespace fulcrum::physics {

class PaperSolver final : public StoreSolver {
 public:
  explicit PaperSolver(const SceneView& scene)
      : StoreSolver(scene), iterations_(scene.physics.iterations), solver_(scene.physics, &tissue_, &particles_) {}

  void Step() override {
    solver_.Predict();
    for (std::size_t i = 0; i < held_.size(); ++i) {
      particles_.Set(held_[i], places_[i]);
    }
    for (std::uint32_t i = 0; i < iterations_; ++i) {
      solver_.Iterate();
    }
    solver_.Finish();
  }

 private:
  std::uint32_t iterations_;
  PbdSolver solver_;
};

}  // namespace fulcrum::physics
