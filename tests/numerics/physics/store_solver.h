// Adapter of solvers over a ParticleStore and a TissueModel to the test interface: everything except the step itself.
#pragma once

#include <vector>

#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "tests/numerics/physics/solver_under_test.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::physics {

class StoreSolver : public SolverUnderTest {
 public:
  explicit StoreSolver(const SceneView& scene) : scene_(scene), particles_(scene), tissue_(scene, &particles_) {
    topology_ = WholeTopology(scene);
  }

  void SetPositions(std::span<const float> xyz) override {
    particles_.SetAll(xyz, xyz);
    Stop();
  }
  void ReadPositions(std::span<float> xyz) const override { particles_.CopyPositions(xyz); }
  void Hold(std::span<const Index> particles) override {
    for (std::size_t i = 0; i < held_.size(); ++i) {
      particles_.SetInverseMass(held_[i], tissue_.BaseInverseMass(held_particles_[i]));
    }
    held_particles_.assign(particles.begin(), particles.end());
    held_.clear();
    places_.clear();
    for (const Index p : particles) {
      held_.push_back(particles_.Ref(p));
      places_.push_back(particles_.At(held_.back()));
      particles_.SetInverseMass(held_.back(), 0);
    }
    HeldChanged();
  }
  void MoveHeld(std::span<const Vec3f> places) override { places_.assign(places.begin(), places.end()); }
  void CutEdges(std::span<const std::size_t> edges) override {
    for (const std::size_t edge : edges) {
      SetBit(topology_.dead_edges, edge);
    }
    ++topology_.revision;
    tissue_.Apply(topology_, &particles_);
    TopologyChanged();
  }

 protected:
  /// Resets velocities and other history after positions have been set.
  virtual void Stop() {}
  /// Called when inverse masses have changed.
  virtual void HeldChanged() {}
  /// Called when tissue_ has changed.
  virtual void TopologyChanged() {}

  SceneView scene_;
  ParticleStore particles_;
  TissueModel tissue_;
  TopologyState topology_;
  std::vector<Index> held_particles_;
  std::vector<ParticleRef> held_;
  std::vector<Vec3f> places_;  ///< Positions of the held particles at the end of the step.
};

}  // namespace fulcrum::physics
