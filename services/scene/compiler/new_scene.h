// Writes the description of a new scene around a mesh: membrane, tools, scope and a script that grasps and cuts, sized
// to the organ.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/scene/builder/scene_settings.h"
#include "services/scene/compiler/compile.h"

namespace fulcrum::scene {

/// Something beside the organ.
struct NewNeighbour {
  FixedSettings surface;
  std::string material;       ///< Of a deformable body; empty: it is fixed.
  bool cap_openings = false;  ///< Of a deformable body: its surface is open.
  double tet_edge_mm = 6;
  Vec3d held_side = Vec3d::UnitZ();  ///< In the frame of the file.
};

struct NewScene {
  std::string name;
  std::filesystem::path mesh;
  std::string mesh_text;        ///< As the description shall name the file.
  std::string unit;             ///< Empty: the one in which the organ has a likely size.
  std::optional<Vec3d> at_mm;   ///< Middle of the membrane, in the frame of the file.
  std::optional<Vec3d> facing;  ///< From the organ to the membrane, in the frame of the file.
  /// In files beside that of the organ, in the same frame. Scope and tools are placed clear of them and, without
  /// `facing`, the membrane on a side that can be seen.
  std::vector<NewNeighbour> neighbours;
  std::vector<AttachSettings> attach;
};

/// The text of the description. Imports the mesh on the way, which decides what it says. Throws InputError.
std::string DescribeNewScene(const NewScene& scene, const Progress& progress);

}  // namespace fulcrum::scene
