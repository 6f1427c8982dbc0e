// Steam and smoke of the cut: a bounded number of soft puffs that rise, grow and fade, and what they leave in the gas
// of the cavity, which clears as the insufflator exchanges it. Both are functions of the puffs' start times and of the
// present time, so they do not depend on the number of pictures drawn before.
#pragma once

#include <array>

#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

class Smoke {
 public:
  Smoke();
  /// Starts a puff at p_W [m], which replaces the oldest one. Calls within kLeastInterval of the last start are
  /// ignored.
  void Add(const Vec3f& p_W, double session_time_s);
  /// Builds the squares for this time. Returns true while puffs are visible, and once after the last one has
  /// disappeared.
  bool Update(double session_time_s);
  /// Share of the light that the smoke in the cavity scatters before it reaches the eye, in steps of 1/64: 0 clear.
  [[nodiscard]] float HazeAt(double session_time_s) const;
  [[nodiscard]] osg::Geometry* geometry() const { return mesh_.geometry(); }
  [[nodiscard]] osg::StateSet* state() const { return mesh_.state(); }

 private:
  struct Puff {
    Vec3f p_W = Vec3f::Zero();
    double born_s = -1e9;
    float drift = 0;  // Direction of the lateral drift [rad].
  };
  std::array<Puff, 28> puffs_;
  std::size_t next_ = 0;
  bool shown_ = true;
  double last_birth_s_ = -1e9;
  double puffs_in_gas_ = 0;  // At the last birth; those that have left count in part.
  Mesh mesh_;
};

}  // namespace fulcrum::render
