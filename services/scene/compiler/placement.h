// Finds what a description leaves out about an imported organ: its centre line or, for a body that is no tube, the
// patch of its surface that the membrane covers, and from these the scene's frame.
#pragma once

#include <string>
#include <vector>

#include "services/scene/builder/scene_settings.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// Frame W over an organ in the frame of its files: z from the organ to the membrane, y along it.
struct Placement {
  Mat3d R_WF = Mat3d::Identity();
  Vec3d origin_m = Vec3d::Zero();  ///< Of W, in the frame of the files.
  std::vector<Vec3d> centre_line;  ///< In W [m]; empty: the body is no tube, and the membrane covers a patch.
  double patch_width_m = 0, patch_length_m = 0;

  [[nodiscard]] Vec3d ToWorld(const Vec3d& p_F) const { return R_WF * (p_F - origin_m); }
};

/// Axis of a tube: centroids of the bands of equal geodesic distance from one of its ends, smoothed. Empty for a body
/// less than twice as long as thick. `surface` is closed, its triangles about equally large.
std::vector<Vec3d> FindCentreLine(const TriangleMesh& surface);

/// Placements of a tube along `line`, the best guess first: z is `import.facing` if given, else the nearest to the
/// files' z axis, across the line, then the other sides in turn.
std::vector<Placement> PlacesOfTube(const std::vector<Vec3d>& line, const ImportSettings& import);

/// Placement of any body, seen along `import.facing`, else along the normal at `import.patch_at_m`, else along its
/// shortest principal axis. The patch lies around `import.patch_at_m`, else where the body's outline is widest, and is
/// as large as that permits.
Placement PlacePatch(const TriangleMesh& surface, const ImportSettings& import);

/// The longest side of the box around points [m].
double LongestSide(const std::vector<Vec3d>& points);
/// The same of the elements of a file, in its unit; vertices that none uses do not count.
double LongestSide(const MeshFile& file);

}  // namespace fulcrum::scene
