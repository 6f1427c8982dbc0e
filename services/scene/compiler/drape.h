// Drapes the membrane over an imported organ: offset from its surface, then regular resampling (as the paper generates
// its membranes).
#pragma once

#include <string>
#include <vector>

#include "services/scene/builder/scene_settings.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// A smooth curve through points, by arc length.
class CentreLine {
 public:
  /// At least two different points [m].
  explicit CentreLine(const std::vector<Vec3d>& points);

  [[nodiscard]] double length() const { return length_.back(); }
  [[nodiscard]] Vec3d At(double fraction) const;
  /// Unit tangent towards growing fraction; averaged over a tenth of the curve, so that neighbouring cross planes
  /// agree.
  [[nodiscard]] Vec3d Tangent(double fraction) const;
  /// Fraction of the curve's point nearest to `p`.
  [[nodiscard]] double Project(const Vec3d& p) const;

 private:
  std::vector<Vec3d> points_;
  std::vector<double> length_;
};

/// The membrane's nodes, row by row [m]: all outside the organ, columns along +(tangent x facing), rows along the
/// centre line. Throws InputError "name: reason" when rays from the centre line miss the organ or the sheet folds over.
std::vector<Vec3d> DrapeMembrane(const ImportSettings& import, const MembraneSettings& membrane,
                                 const CentreLine& centre_line, const Vec3d& facing, const TriangleMesh& organ,
                                 const std::string& name);

/// The nodes of a membrane over a patch of the organ, seen along -z: a rectangle of `width` x `length` [m] around the
/// origin, which spans hollows and steep sides as a taut sheet would and is fused with the organ at its rim. Columns
/// along +x, rows along +y. Throws InputError "name: reason".
std::vector<Vec3d> DrapePatch(double width, double length, const MembraneSettings& membrane, const TriangleMesh& organ,
                              const std::string& name);

/// The fixed surface that continues a membrane on both sides by `width`, beginning slightly below its rims.
TriangleMesh ContinueSideways(int rows, int cols, const std::vector<Vec3d>& sheet, double width);

}  // namespace fulcrum::scene
