// A small solver for contact rows, to test the code that generates them: position-based dynamics in substeps.
#pragma once

#include <algorithm>
#include <vector>

#include "physics_node/collision/row_projection.h"
#include "physics_node/collision/tool_collision.h"
#include "physics_node/pbd/pbd_solver.h"

namespace fulcrum::physics {

class RowPlayer {
 public:
  /// Steps of `dt_s` seconds in `substeps` substeps.
  explicit RowPlayer(const SceneView& scene, int substeps = 2, float dt_s = 0.01f)
      : scene_(Substepped(scene, dt_s / static_cast<float>(substeps))),
        particles_(scene_),
        model_(scene_, &particles_),
        solver_(scene_.physics, &model_, &particles_),
        tools_(scene_, &model_, &particles_),
        substeps_(substeps) {
    rows_.reserve(kMaxTools * ToolCollision::kMaxRows);
  }

  /// A whole step in which tool `tool` moves from its last pose to `pose`. Calls `visit(rows)` with the rows of each
  /// substep.
  template <class Visit>
  void Step(std::size_t tool, const ToolPose& pose, const Visit& visit) {
    const ToolPose from = known_ ? last_ : pose;
    std::array<ToolCollision::ToolMotion, kMaxTools> motions;
    motions[tool] = {ShapeOf(scene_.tools[tool], from), ShapeOf(scene_.tools[tool], pose), false, false};
    tools_.FindPairs(motions, true, LargestMove());
    for (int s = 0; s < substeps_; ++s) {
      const float u0 = static_cast<float>(s) / static_cast<float>(substeps_);
      tools_.Rows(u0, u0 + 1.0f / static_cast<float>(substeps_), &rows_);
      visit(rows_);
      solver_.Predict();
      for (int iteration = 0; iteration < 6; ++iteration) {
        solver_.Iterate();
        ProjectRows(rows_, 0.01f, scene_.physics.dt_s, &particles_);
      }
      tools_.TakeForces(rows_);
      solver_.Finish();
    }
    last_ = pose;
    known_ = true;
  }
  void Step(std::size_t tool, const ToolPose& pose) {
    Step(tool, pose, [](const std::vector<ContactRow>&) {});
  }

  [[nodiscard]] ParticleStore& particles() { return particles_; }
  [[nodiscard]] TissueModel& model() { return model_; }
  [[nodiscard]] ToolCollision& tools() { return tools_; }
  [[nodiscard]] const SceneView& scene() const { return scene_; }
  [[nodiscard]] std::vector<ContactRow>& rows() { return rows_; }

 private:
  static SceneView Substepped(SceneView scene, float dt_s) {
    scene.physics.dt_s = dt_s;
    return scene;
  }

  /// Largest move of a particle in the last substep [m].
  [[nodiscard]] float LargestMove() const {
    float largest = 0;
    for (Index p = 0; p < particles_.particle_count(); ++p) {
      const ParticleRef at = particles_.Ref(p);
      largest = std::max(largest, (particles_.At(at) - particles_.Previous(at)).norm());
    }
    return largest;
  }

  SceneView scene_;
  ParticleStore particles_;
  TissueModel model_;
  PbdSolver solver_;
  ToolCollision tools_;
  int substeps_;
  std::vector<ContactRow> rows_;
  ToolPose last_;
  bool known_ = false;
};

}  // namespace fulcrum::physics
