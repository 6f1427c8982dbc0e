// Steam and smoke of the cut: a bounded number of soft puffs that rise, grow and fade, and what they leave in the gas
// of the cavity, which clears as the insufflator exchanges it, and faster while a tube aspirates gas. Both are
// functions of the puffs' start times, the tubes and the present time, so they do not depend on the number of pictures
// drawn before: what a tube draws moves in steps of 20 ms.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

class Smoke {
 public:
  Smoke();
  /// Starts a puff at p_W [m], which replaces the oldest one. Calls within kLeastInterval of the last start are
  /// ignored.
  void Add(const Vec3f& p_W, double session_time_s);
  /// Places of tubes that aspirate gas from now on [m], frame W: it flows to them as to sinks, and what arrives is
  /// gone. @param session_time_s that of the last Update.
  void SetSinks(std::span<const Vec3f> sinks_W, double session_time_s);
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
    Vec3f drawn = Vec3f::Zero();  // By sinks, from where it would be otherwise [m].
    double born_s = -1e9;
    float drift = 0;  // Direction of the lateral drift [rad].
  };
  static Vec3f PlaceOf(const Puff& puff, float age_s);
  void Draw(double step_s, double session_time_s);
  [[nodiscard]] double InGasAt(double session_time_s) const;

  std::array<Puff, 28> puffs_;
  std::size_t next_ = 0;
  bool shown_ = true;
  double last_birth_s_ = -1e9;
  double puffs_in_gas_ = 0;  // At in_gas_s_; those that have left count in part.
  double in_gas_s_ = -1e9;
  std::vector<Vec3f> sinks_;
  double drawn_s_ = 0;  // Up to which sinks have drawn.
  Mesh mesh_;
};

}  // namespace fulcrum::render
