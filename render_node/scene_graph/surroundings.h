// Rigid surroundings: the fixed surfaces of the scene, a cavity around them, anatomy that is not simulated, and the
// black rim of the optics.
#pragma once

#include <array>
#include <osg/Geode>

#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/look.h"

namespace fulcrum::render {

class BackgroundAnatomy;

/// Linear colour; the last value is the share of visible fat.
[[nodiscard]] std::array<float, 4> SurroundingColour(SurfaceRole role);

class Surroundings {
 public:
  Surroundings(const SceneView& scene, const Laparoscope& scope, const Look& look);

  /// Sets the displacement of the breathing surfaces [m].
  void SetShift(const Vec3f& shift) { shift_->set(osg::Vec3(shift.x(), shift.y(), shift.z())); }
  /// Surfaces that never move.
  [[nodiscard]] osg::Geode* fixed() const { return fixed_; }
  [[nodiscard]] osg::Geode* breathing() const { return breathing_; }

 private:
  void AddMask(const Laparoscope& scope);
  void AddSurfaces(const SceneView& scene, const Laparoscope& scope, const BackgroundAnatomy& anatomy, const char* name,
                   bool breathing);

  osg::ref_ptr<osg::Geode> fixed_ = new osg::Geode, breathing_ = new osg::Geode;
  osg::ref_ptr<osg::Uniform> shift_ = new osg::Uniform("shift", osg::Vec3(0, 0, 0));
};

}  // namespace fulcrum::render
