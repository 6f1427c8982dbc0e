// Bodies of simple shape: closed surfaces, and tubes of tetrahedra.
#pragma once

#include "services/scene/builder/scene_settings.h"
#include "services/scene/compiler/tet_repair.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// The closed surface of a shape, seen from outside [m]. Throws InputError for a line that is too long for its radius.
TriangleMesh SurfaceOfShape(const ShapeSettings& shape);

struct TubeBody {
  TetrahedralMesh tets;
  TriangleMesh surface;
  Index ring_vertices = 0;  ///< The first ring has the first of the vertices, the last one the last.
};

/// A swept shape as rings of six vertices around its line, `spacing` apart, each wedge between them as three
/// tetrahedra; the surface is rounder. Throws InputError where it bends more tightly than its radius.
TubeBody TubeOfShape(const ShapeSettings& shape, double spacing);

}  // namespace fulcrum::scene
