// Blood: a vessel that is opened before heat has closed it lets drops go, which run down the sheet and leave a film.
// Bounded: a few sources, a few dozen drops. What happens is a function of the events and of time in steps of 20 ms,
// not of how many pictures are drawn. Pure.
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
  /// `vessels`: a square pattern of four bytes a texel whose alpha is how much of a vessel there is, `per_m` of it to
  /// the metre of (s, t). Keeps references to the pattern and the arrays of `scene`.
  Bleeding(const SceneView& scene, std::span<const std::uint8_t> vessels, int texels, float per_m);

  /// A cut was made at `material` [m]: whatever vessel ends at its rim in living tissue begins to bleed.
  void Cut(const Vec2f& material, const Atlas& atlas, double session_time_s);

  /// Moves the drops on, stains the atlas, and stops the sources that heat has sealed since (damage above a half, or
  /// nothing left). Returns the texels touched.
  AtlasRect Update(double session_time_s, const MembraneMesh& membrane, Atlas* atlas);

  [[nodiscard]] int sources() const;
  [[nodiscard]] int drops() const;

 private:
  struct Source {
    bool open = false;
    Vec2f material = Vec2f::Zero();
    Index node = 0;  // Of the grid, nearest.
    int steps = 0;   // Since it opened.
  };
  struct Drop {
    float left_m = 0;  // Way until nothing of it is left; 0: none.
    Vec2f material = Vec2f::Zero();
    Index node = 0;
    float phase = 0;  // Of its straying [rad].
  };
  [[nodiscard]] float VesselAt(const Vec2f& material) const;
  [[nodiscard]] Index NearestNode(const Vec2f& material, Index start) const;
  [[nodiscard]] Vec2f Downhill(Index node, std::span<const Vec3f> positions) const;
  AtlasRect Bleed(Source* source, Atlas* atlas);
  AtlasRect Run(Drop* drop, std::span<const Vec3f> positions, Atlas* atlas);

  SceneView scene_;
  std::span<const std::uint8_t> vessels_;
  int texels_;
  float per_m_;
  std::array<Source, 8> sources_;
  std::array<Drop, 48> drops_;
  std::size_t next_source_ = 0, next_drop_ = 0;
  double time_s_ = 0;  // Of the last step.
};

}  // namespace fulcrum::render
