// Adapter of the accurate mode to the test interface: the preset of the scene, without tools.
#pragma once

#include "physics_node/implicit/implicit_solver.h"
#include "tests/numerics/physics/store_solver.h"

namespace fulcrum::physics {

class AccurateUnderTest : public StoreSolver {
 public:
  explicit AccurateUnderTest(const SceneView& scene, int threads = 1)
      : StoreSolver(scene),
        effort_(implicit::EffortOf(scene.physics.preset)),
        solver_(scene, BuildElasticModel(scene), tissue_, &particles_, threads) {}

  void Step() override {
    solver_.BeginStep();
    FindPairs(solver_.moved());
    for (int s = 1; s <= effort_.substeps; ++s) {
      const float part = static_cast<float>(s) / static_cast<float>(effort_.substeps);
      for (std::size_t i = 0; i < held_.size(); ++i) {
        targets_[i].place = begin_[i] + part * (places_[i] - begin_[i]);
      }
      solver_.Substep(scene_.physics.dt_s / static_cast<float>(effort_.substeps), effort_.iterations, targets_,
                      Contacts(1.0f / static_cast<float>(effort_.substeps)));
    }
    begin_ = places_;
  }

  /// Puts a particle somewhere else, without a word to the solver.
  void Place(Index particle, const Vec3f& p) {
    particles_.Set(particles_.Ref(particle), p);
    particles_.SetPrevious(particles_.Ref(particle), p);
  }
  /// Fraction of the tissue that is awake after the last step.
  [[nodiscard]] float awake_part() const { return solver_.regions().awake_part(); }

 protected:
  /// Contacts of a step; `part`: length of a substep as part of it.
  virtual void FindPairs(std::span<const float>) {}
  virtual std::span<ContactRow> Contacts(float) { return {}; }
  void Stop() override { solver_.Stop(); }
  void HeldChanged() override {
    targets_.clear();
    for (const ParticleRef at : held_) {
      targets_.push_back({at, particles_.At(at)});
    }
    begin_ = places_;
  }
  void TopologyChanged() override { solver_.UpdateTopology(tissue_); }

 private:
  implicit::Effort effort_;
  implicit::ImplicitSolver solver_;
  std::vector<implicit::HeldPlace> targets_;
  std::vector<Vec3f> begin_;  ///< Positions of the held particles at the start of the step.
};

}  // namespace fulcrum::physics
