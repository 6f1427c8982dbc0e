// Blood: a vessel that is opened before heat has sealed it releases drops, which run down the sheet and leave a film.
// The numbers of sources and drops are bounded. The state is a function of the events and of time in steps of 20 ms,
// independent of the number of pictures. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/membrane_mesh.h"

namespace fulcrum::render {

class Bleeding {
 public:
  /// @param vessels square pattern of four bytes per texel; alpha is the density of vessels. @param per_m repetitions
  /// of the pattern per metre of (s, t). Keeps references to the pattern and the arrays of `scene`.
  Bleeding(const SceneView& scene, std::span<const std::uint8_t> vessels, int texels, float per_m);

  /// Registers a cut at `material` [m]: a vessel that ends at its rim in living tissue begins to bleed.
  void Cut(const Vec2f& material, const Atlas& atlas, double session_time_s);

  /// Moves the drops, stains the atlas, and closes sources that heat has sealed (damage above a half, or tissue
  /// removed) or that have bled for 8 s. Returns whether the film of the atlas has changed.
  bool Update(double session_time_s, const MembraneMesh& membrane, Atlas* atlas);

  [[nodiscard]] int sources() const;
  [[nodiscard]] int drops() const;

 private:
  struct Source {
    bool open = false;
    Vec2f material = Vec2f::Zero();
    Index node = 0;  // Nearest node of the grid.
    int steps = 0;   // Steps since it opened.
  };
  struct Drop {
    float left_m = 0;  // Remaining length of the run [m]; 0: no drop.
    Vec2f material = Vec2f::Zero();
    Index node = 0;
    float phase = 0;  // Phase of the lateral deviation [rad].
  };
  [[nodiscard]] float VesselAt(const Vec2f& material) const;
  [[nodiscard]] Index NearestNode(const Vec2f& material, Index start) const;
  [[nodiscard]] Vec2f Downhill(Index node, std::span<const Vec3f> positions) const;
  bool Bleed(Source* source, Atlas* atlas);
  bool Run(Drop* drop, std::span<const Vec3f> positions, Atlas* atlas);

  SceneView scene_;
  std::span<const std::uint8_t> vessels_;
  int texels_;
  float per_m_;
  std::array<Source, 8> sources_;
  std::array<Drop, 48> drops_;
  std::size_t next_source_ = 0, next_drop_ = 0;
  double time_s_ = 0;  // Session time of the last step [s].
};

}  // namespace fulcrum::render
