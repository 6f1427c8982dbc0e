// Adapter of small-step XPBD to the test interface: PhysicsParams.substeps, without tools.
#pragma once

#include "physics_node/xpbd/xpbd_solver.h"
#include "tests/numerics/physics/store_solver.h"

namespace fulcrum::physics {

class XpbdUnderTest final : public StoreSolver {
 public:
  explicit XpbdUnderTest(const SceneView& scene)
      : StoreSolver(scene),
        substeps_(scene.physics.substeps),
        h_(scene.physics.dt_s / static_cast<float>(substeps_)),
        solver_(BuildElasticModel(scene), &tissue_, &particles_) {}

  void Step() override {
    for (std::uint32_t s = 1; s <= substeps_; ++s) {
      solver_.Predict(h_);
      const float part = static_cast<float>(s) / static_cast<float>(substeps_);
      for (std::size_t i = 0; i < held_.size(); ++i) {
        particles_.Set(held_[i], begin_[i] + part * (places_[i] - begin_[i]));
      }
      solver_.Iterate(h_);
      solver_.Finish(h_);
    }
    begin_ = places_;
  }

 private:
  void Stop() override { solver_.Stop(); }
  void HeldChanged() override { begin_ = places_; }

  std::uint32_t substeps_;
  float h_;
  xpbd::XpbdSolver solver_;
  std::vector<Vec3f> begin_;  ///< Positions of the held particles at the start of the step.
};

}  // namespace fulcrum::physics
