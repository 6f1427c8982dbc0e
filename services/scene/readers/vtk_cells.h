// Cells as in both families of VTK files.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

struct VtkCells {
  std::vector<std::int64_t> offsets;       ///< Index of each cell's first entry in `connectivity`; one more at the end.
  std::vector<std::int64_t> connectivity;  ///< Vertices.
  std::vector<std::int64_t> types;         ///< VTK's type numbers, one per cell.
};

/// Called with a fault of the cells; throws.
using VtkFault = std::function<void(const std::string&)>;

/// Appends cells to `mesh` over `vertex_count` of its vertices from `first_vertex` on. Checks everything.
void AddVtkCells(const VtkCells& cells, Index first_vertex, std::size_t vertex_count, const VtkFault& fail,
                 MeshFile* mesh);

}  // namespace fulcrum::scene
