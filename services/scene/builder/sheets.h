// The sheets of a scene on their common grid: particles, edges, bending, bindings and material coordinates.
#pragma once

#include "services/scene/builder/build.h"

namespace fulcrum::scene {

/// The rectangle of each sheet, one below the other. One sheet fills the grid.
std::vector<SheetPart> PlaceSheets(const std::vector<SheetBody>& sheets);

/// A sheet on the grid, with its point at fractions (s, t), bilinear between its nodes.
class PlacedSheet {
 public:
  struct Point {
    Vec3d p, normal;
    Vec2f material;
  };
  /// Keeps references.
  PlacedSheet(const SheetBody& body, const SheetPart& part, const MembraneGrid& grid,
              const std::vector<Vec2f>& material);

  [[nodiscard]] Point At(double s, double t) const;
  [[nodiscard]] const std::string& name() const { return body_.name; }

 private:
  const SheetBody& body_;
  SheetPart part_;
  std::uint32_t cols_;
  const std::vector<Vec2f>& material_;
};

/// Appends places and inverse masses of the grid's nodes. @pre the grid of `scene` has its size.
void AddSheetParticles(const std::vector<SheetBody>& sheets, const std::vector<SheetPart>& parts, SceneData* scene);
/// Rest lengths and bending.
void AddSheetConstraints(const std::vector<SheetBody>& sheets, const std::vector<SheetPart>& parts, SceneData* scene);
/// Bindings to the surface of the solids, whose vertices in double are `vertices`. Throws InputError.
void AddBindings(const SceneSettings& settings, const Anatomy& anatomy, const std::vector<SheetPart>& parts,
                 const std::vector<Vec3d>& vertices, SceneData* scene);
/// Material coordinates of the grid's nodes: each sheet is flattened and has a place in the atlas. Throws InputError.
std::vector<Vec2f> SheetMaterial(const SceneSettings& settings, const std::vector<SheetBody>& sheets,
                                 const std::vector<SheetPart>& parts, const MembraneGrid& grid);

}  // namespace fulcrum::scene
