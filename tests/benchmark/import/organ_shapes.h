// Organs as other people's files give them: closed shapes of many kinds, and the faults of real segmentations.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "services/scene/readers/mesh_io.h"

namespace fulcrum::benchmark {

/// Signed distance, about: negative inside. Millimetres.
using Shape = std::function<double(const Vec3d&)>;

struct Organ {
  std::string name;
  scene::MeshFile mesh;  ///< Millimetres, unless `unit` says otherwise.
  std::string file;      ///< Its extension decides the writer.
  std::string options;   ///< Further keys of the description's section `import`.
  bool is_sound = true;  ///< False: no organ at all, to be refused.
};

/// Boundary of a shape inside a box of half size `reach` [mm] around the origin, by marching tetrahedra on `cells`
/// cubes either way. Closed, outward.
scene::TriangleMesh SurfaceOfShape(const Shape& shape, double reach, int cells);

/// Organs with and without faults, in every format that can be read, in a fixed order.
std::vector<Organ> Organs();

/// Organs of a pelvis that do not overlap; two of them touch.
struct Part {
  std::string name;
  int label;
  bool is_organ;
  Shape shape;  ///< An exact distance near the surface.
};
std::vector<Part> Pelvis();

}  // namespace fulcrum::benchmark
