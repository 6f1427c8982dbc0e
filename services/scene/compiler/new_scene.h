// Writes the description of a new scene around a mesh: membrane, tools, scope and a script that grasps and cuts, sized
// to the organ.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "services/scene/compiler/compile.h"

namespace fulcrum::scene {

struct NewScene {
  std::string name;
  std::filesystem::path mesh;
  std::string mesh_text;             ///< As the description shall name the file.
  std::string unit;                  ///< Empty: the one in which the organ has a likely size.
  std::optional<Vec3d> at_mm;        ///< Middle of the membrane, in the frame of the file.
  std::optional<Vec3d> facing;       ///< From the organ to the membrane, in the frame of the file.
  std::string surroundings;          ///< Lines of the list `surroundings`, indented by six; may be empty.
};

/// The text of the description. Imports the mesh on the way, which decides what it says. Throws InputError.
std::string DescribeNewScene(const NewScene& scene, const Progress& progress);

}  // namespace fulcrum::scene
