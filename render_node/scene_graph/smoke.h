// Steam and smoke of the cut: a bounded number of soft puffs that rise, grow and fade. What is drawn is a function of
// the puffs' births and of the time, so a picture does not depend on how many were drawn before it.
#pragma once

#include <array>

#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

class Smoke {
 public:
  Smoke();
  /// A puff is born at p_W [m]; the oldest makes room. Births within kLeastInterval of the last one are left out.
  void Add(const Vec3f& p_W, double session_time_s);
  /// Builds the squares for this time. True when there is something to see, or no longer is.
  bool Update(double session_time_s);
  [[nodiscard]] osg::Geometry* geometry() const { return mesh_.geometry(); }
  [[nodiscard]] osg::StateSet* state() const { return mesh_.state(); }

 private:
  struct Puff {
    Vec3f p_W = Vec3f::Zero();
    double born_s = -1e9;
    float drift = 0;  // Direction of its sideways drift [rad].
  };
  std::array<Puff, 28> puffs_;
  std::size_t next_ = 0;
  bool shown_ = true;
  double last_birth_s_ = -1e9;
  Mesh mesh_;
};

}  // namespace fulcrum::render
