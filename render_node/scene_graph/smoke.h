// Steam and smoke of the cut: a bounded number of soft puffs that rise, grow and fade. The drawing is a function of the
// puffs' start times and of the present time, so it does not depend on the number of pictures drawn before.
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
  Mesh mesh_;
};

}  // namespace fulcrum::render
