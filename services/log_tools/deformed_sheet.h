// The membrane as it lies in the world, cut or not: which place of the sheet is nearest to a point.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "services/core/scene_view.h"

namespace fulcrum::log_tools {

/// Knows the scene's grid and the recorded positions, and nothing of the solvers: it is the outsider's measure of what
/// they report.
class DeformedSheet {
 public:
  /// @param scene must outlive this.
  explicit DeformedSheet(const SceneView& scene);

  /// TopologyState's bits. A dead node is taken to lie in the mean of its living neighbours, so that the sheet is whole
  /// where it was cut.
  void SetDeadNodes(std::span<const std::uint8_t> bits);
  /// Positions of all particles as in a TissueFrame; false when they do not fit the scene.
  bool SetPositions(std::span<const float> xyz);

  struct Place {
    float distance_m = 0;
    Vec2f material = Vec2f::Zero();  ///< (s, t) [m].
  };
  /// Nothing when all of the sheet is farther than `within_m`.
  [[nodiscard]] std::optional<Place> Nearest(const Vec3f& p_W, float within_m) const;

 private:
  [[nodiscard]] std::size_t Node(int row, int col) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(col);
  }
  void FillDeadNodes();

  const SceneView& scene_;
  int rows_, cols_;
  float coarse_reach_m_ = 0;
  std::vector<std::uint8_t> dead_;
  std::vector<std::size_t> dead_nodes_;
  std::vector<Vec3f> place_;  ///< [rows * cols] frame W [m].
};

}  // namespace fulcrum::log_tools
