// The small scene with further solids beside it: a held pad, a loose lump above the pad, and two strands, one of them
// joined to the pad.
#pragma once

#include <string>
#include <utility>

#include "services/scene/builder/build.h"
#include "services/scene/builder/geometry.h"

namespace fulcrum {

/// A box of n cubes along each side, six tetrahedra each.
inline scene::SolidBody Box(std::string name, const Vec3d& low, const Vec3d& size, const std::array<int, 3>& n,
                            double youngs_modulus_Pa) {
  scene::SolidBody body;
  body.name = std::move(name);
  body.material = {SolidLook::kLiver, youngs_modulus_Pa, 1000};
  const auto id = [&](int x, int y, int z) { return static_cast<Index>((z * (n[1] + 1) + y) * (n[0] + 1) + x); };
  for (int z = 0; z <= n[2]; ++z) {
    for (int y = 0; y <= n[1]; ++y) {
      for (int x = 0; x <= n[0]; ++x) {
        body.vertices.push_back(low + size.cwiseProduct(Vec3d(1.0 * x / n[0], 1.0 * y / n[1], 1.0 * z / n[2])));
      }
    }
  }
  constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        for (const auto& path : kPaths) {
          std::array<int, 3> at{x, y, z};
          Tetrahedron tet{};
          tet[0] = id(x, y, z);
          for (std::size_t k = 0; k < 3; ++k) {
            ++at[static_cast<std::size_t>(path[k])];
            tet[k + 1] = id(at[0], at[1], at[2]);
          }
          const auto& v = body.vertices;
          if (scene::SignedVolume(v[tet[0]], v[tet[1]], v[tet[2]], v[tet[3]]) < 0) std::swap(tet[2], tet[3]);
          body.tets.push_back(tet);
        }
      }
    }
  }
  body.fixed.assign(body.vertices.size(), false);
  body.surface_vertices = body.vertices;
  body.surface_triangles = scene::BoundaryOf(body.tets);
  return body;
}

/// Fixes the vertices for which `held` is true.
template <class Held>
void Fix(scene::SolidBody* body, const Held& held) {
  for (std::size_t i = 0; i < body->vertices.size(); ++i) body->fixed[i] = body->fixed[i] || held(body->vertices[i]);
}

/// A sheet of 25 x 13 nodes over pad, lump and both strands, with free sides, bound to the lump four millimetres below
/// it.
inline scene::SheetBody Veil(const Vec3d& corner) {
  scene::SheetBody veil;
  veil.name = "veil";
  veil.grid.rows = 25;
  veil.grid.cols = 13;
  veil.grid.bending_row_stride = 4;
  veil.grid.bending_col_stride = 3;
  veil.sides_held = false;
  for (int r = 0; r < 25; ++r) {
    for (int c = 0; c < 13; ++c) {
      const double s = c / 12.0 - 0.5, t = r / 24.0;
      veil.nodes.push_back(corner + Vec3d(0.02 + 0.03 * s, -0.01 + 0.08 * t, 0.04 - 0.01 * s * s));
    }
  }
  return veil;
}

/// Adds solids beside the organ, 1 `pad`, 2 `lump`, 3 `strand`, 4 `other strand`, the pad's lower corner at `corner`.
/// The lump is loose unless it is `joined` to the pad, as `kind` says. If `veiled`, with a second sheet.
inline scene::SceneData WithSolids(scene::SceneSettings settings, const Vec3d& corner, bool joined,
                                   double strand_Pa = 2e5, bool veiled = false,
                                   scene::AttachKind kind = scene::AttachKind::kGlued) {
  settings.physics.mode = PhysicsMode::kAccurate;
  settings.attach = {{"strand", "pad", 0.002, 5e4}};
  if (joined) settings.attach.push_back({"lump", "pad", 0.002, 2e4, kind});
  scene::Anatomy anatomy = scene::ProceduralAnatomy(settings);
  const auto at = [&](double x, double y, double z) { return Vec3d(corner + Vec3d(x, y, z)); };
  scene::SolidBody pad = Box("pad", corner, {0.04, 0.04, 0.015}, {8, 8, 3}, 2e4);
  Fix(&pad, [&](const Vec3d& p) { return p.z() < corner.z() + 1e-6; });
  scene::SolidBody strand = Box("strand", at(0.041, 0.018, 0.004), {0.06, 0.004, 0.004}, {15, 1, 1}, strand_Pa);
  Fix(&strand, [&](const Vec3d& p) { return p.x() > corner.x() + 0.1009; });
  scene::SolidBody other = Box("other strand", at(0, 0.05, 0.004), {0.06, 0.004, 0.004}, {15, 1, 1}, strand_Pa);
  Fix(&other, [&](const Vec3d& p) { return p.x() > corner.x() + 0.0599 || p.x() < corner.x() + 1e-4; });
  anatomy.solids.push_back(std::move(pad));
  anatomy.solids.push_back(Box("lump", at(0.01, 0.01, 0.016), {0.02, 0.02, 0.02}, {4, 4, 4}, 4e4));
  anatomy.solids.push_back(std::move(strand));
  anatomy.solids.push_back(std::move(other));
  if (veiled) anatomy.sheets.push_back(Veil(corner));
  return scene::AssembleScene(settings, anatomy);
}

/// The small scene with solids 120 mm beside the organ.
inline scene::SceneData SeveralSolids(const Vec3f& gravity = Vec3f::Zero(), bool joined = false, bool veiled = false,
                                      scene::AttachKind kind = scene::AttachKind::kGlued) {
  scene::SceneSettings settings = scene::Small();
  settings.physics.gravity = gravity;
  return WithSolids(std::move(settings), {0.12, -0.02, 0}, joined, 2e5, veiled, kind);
}

}  // namespace fulcrum
