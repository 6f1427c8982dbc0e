// One small valid file for every variant of every mesh format, for tests of the readers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

struct MeshSample {
  std::string label;                          ///< "gmsh22_binary" …
  std::string name;                           ///< "a.msh" …
  std::string bytes;                          ///< Content of the file `name`.
  std::map<std::string, std::string> beside;  ///< Its companions.
  bool has_tets = false;                      ///< Else: the triangles of SampleSurface().
};

/// Two tetrahedra of opposite orientation that share a face; coordinates that text and float hold exactly.
MeshFile SampleTets();
/// A closed surface of triangles: for example the boundary of half a cube.
TriangleMesh SampleSurface();

/// Every variant. Those with tetrahedra also contain elements that readers must ignore: points, lines, values.
std::vector<MeshSample> MeshSamples();

/// Parses `bytes` as the sample's file, with its companions.
MeshFile ParseSample(const MeshSample& sample, const std::string& bytes);

}  // namespace fulcrum::scene
