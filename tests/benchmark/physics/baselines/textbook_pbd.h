// Position-based dynamics as textbooks write it: doubles, one object per constraint, a virtual call each, in the order
// of the scene. The baseline of the vector kernels: the same constraints, iterations and time step.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::physics::baselines {

struct PbdParticle {
  Eigen::Vector3d x, previous;  ///< [m]
  double w;                     ///< Inverse mass, 0 = fixed [1/kg].
};

class PbdConstraint {
 public:
  virtual ~PbdConstraint() = default;
  /// Moves its particles by one projection.
  virtual void Project(std::vector<PbdParticle>* particles) const = 0;
};

class TextbookPbd {
 public:
  /// The order of the membrane's edges. Gauss-Seidel results depend on it: in the kernels' order the two codes must
  /// agree to rounding, in the scene's order only to the residual of three iterations.
  enum class Order { kScene, kKernels };

  explicit TextbookPbd(const SceneView& scene, Order order = Order::kScene);

  /// Predicts, iterates PhysicsParams.iterations times over all constraints; velocities are differences (Verlet).
  void Step();

  [[nodiscard]] std::vector<PbdParticle>& particles() { return particles_; }
  [[nodiscard]] std::size_t constraint_count() const { return constraints_.size(); }

 private:
  PhysicsParams params_;
  std::vector<PbdParticle> particles_;
  std::vector<std::unique_ptr<PbdConstraint>> constraints_;
};

}  // namespace fulcrum::physics::baselines
