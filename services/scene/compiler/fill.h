// From a description of a body - mesh file or shape - to its tetrahedra and its visible surface.
#pragma once

#include <string>

#include "services/scene/builder/scene_settings.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/tetrahedralise.h"

namespace fulcrum::scene {

struct FilledBody {
  TetrahedralMesh tets;
  TriangleMesh surface;
};

/// Tetrahedra of a file, repaired, or those that fill its surface or the shape, in the frame of the files [m]. Throws
/// InputError "name: reason".
FilledBody FillBody(const ImportSettings& import, const std::string& name, const Progress& progress);

/// Refuses what is shorter than `least_m` or longer than `most_m`, with the unit in which it would not be. `file` is in
/// metres, by `scale_m` metres per unit. Throws InputError "name: reason".
void CheckSize(const MeshFile& file, double scale_m, const std::string& name, double least_m, double most_m);

/// From a file's unit and origin to metres.
void ToMetres(double scale_m, const Vec3f& origin_m, const Vec3f& offset_m, std::vector<Vec3d>* points);

}  // namespace fulcrum::scene
