// Two blocks that lie against each other, joined by tissue: the lower one 60 x 40 x 15 mm, held below, the upper one
// 20 x 20 x 10 mm and loose, a millimetre above its middle. No organ, no sheet.
#pragma once

#include <cmath>

#include "tests/support/several_solids.h"

namespace fulcrum {

inline constexpr Index kLowerBlock = 0, kUpperBlock = 1;
inline constexpr double kBlockGap_m = 0.001;

/// The blocks turned by `turn` about the origin, the middle of the lower block's upper side. If `bumpy`, that side has
/// waves of 0.8 mm.
inline scene::SceneData TwoBlocks(scene::AttachKind kind, const Vec3f& gravity = Vec3f::Zero(),
                                  const Mat3d& turn = Mat3d::Identity(), bool bumpy = false) {
  scene::SceneSettings settings = scene::Small();
  settings.name = "two blocks";
  settings.has_organ = false;
  settings.structures.clear();
  settings.script.clear();
  settings.planned_line.clear();
  settings.physics.mode = PhysicsMode::kAccurate;
  settings.physics.gravity = gravity;
  settings.attach = {{"upper", "lower", bumpy ? 0.003 : 0.0015, 5e3, kind}};
  scene::Anatomy anatomy;
  scene::SolidBody lower = Box("lower", {-0.03, -0.02, -0.015}, {0.06, 0.04, 0.015}, {12, 8, 3}, 3e4);
  scene::SolidBody upper = Box("upper", {-0.01, -0.01, kBlockGap_m}, {0.02, 0.02, 0.01}, {4, 4, 2}, 3e4);
  Fix(&lower, [](const Vec3d& p) { return p.z() < -0.0149; });
  for (Vec3d& p : lower.vertices) {
    if (bumpy && p.z() > -1e-6) p.z() += 0.0008 * std::sin(400 * p.x()) * std::cos(300 * p.y());
  }
  for (scene::SolidBody* body : {&lower, &upper}) {
    for (Vec3d& p : body->vertices) p = turn * p;
    body->surface_vertices = body->vertices;
    anatomy.solids.push_back(*body);
  }
  return scene::AssembleScene(settings, anatomy);
}

}  // namespace fulcrum
