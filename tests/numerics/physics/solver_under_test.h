// Interface of a tissue solver for the accuracy benchmark and the robustness matrix.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

class SolverUnderTest {
 public:
  virtual ~SolverUnderTest() = default;

  /// Sets all positions and resets all velocities. [3 * particles] x y z in the order of the scene.
  virtual void SetPositions(std::span<const float> xyz) = 0;
  virtual void ReadPositions(std::span<float> xyz) const = 0;

  /// Holds these particles, and no others, at their present positions. Empty: releases all.
  virtual void Hold(std::span<const Index> particles) = 0;
  /// Positions of the held particles at the end of the next step, in the order of Hold; they move there in a straight
  /// line.
  virtual void MoveHeld(std::span<const Vec3f> places) = 0;
  /// Cuts membrane edges 3 * node + direction.
  virtual void CutEdges(std::span<const std::size_t> edges) = 0;

  /// Advances by the scene's dt_s.
  virtual void Step() = 0;
};

/// The scene must outlive the solver.
using SolverFactory = std::function<std::unique_ptr<SolverUnderTest>(const SceneView&)>;

}  // namespace fulcrum::physics
