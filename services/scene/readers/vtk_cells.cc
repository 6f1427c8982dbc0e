#include "services/scene/readers/vtk_cells.h"

#include <algorithm>
#include <span>

namespace fulcrum::scene {
namespace {

enum Type : std::int64_t {
  kVertex = 1,
  kPolyLine = 4,  ///< Types 1 to 4 are points and lines.
  kTriangle = 5,
  kTriangleStrip = 6,
  kPolygon = 7,
  kPixel = 8,
  kQuad = 9,
  kTetra = 10,
};

void AddFan(std::span<const Index> corners, MeshFile* mesh) {
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    mesh->triangles.push_back({corners[0], corners[k], corners[k + 1]});
  }
}

/// Adds a cell. Returns an empty text, or the fault.
std::string AddCell(std::int64_t type, std::span<Index> corners, MeshFile* mesh) {
  const auto wants = [&](std::size_t least, std::size_t most) {
    return corners.size() < least || corners.size() > most
               ? "type " + std::to_string(type) + " with " + std::to_string(corners.size()) +
                     " corners; valid: " + (least == most ? std::to_string(least) : "at least " + std::to_string(least))
               : std::string();
  };
  std::string fault;
  if (type >= kVertex && type <= kPolyLine) {
    ++mesh->skipped;
  } else if (type == kTriangle || type == kQuad || type == kPolygon) {
    const std::size_t count = type == kTriangle ? 3 : 4;
    fault = type == kPolygon ? wants(3, corners.size()) : wants(count, count);
    AddFan(corners, mesh);
  } else if (type == kPixel) {
    fault = wants(4, 4);
    if (fault.empty()) {
      std::swap(corners[2], corners[3]);  // The corners of a pixel run row by row.
      AddFan(corners, mesh);
    }
  } else if (type == kTriangleStrip) {
    fault = wants(3, std::max<std::size_t>(corners.size(), 3));
    for (std::size_t k = 0; k + 2 < corners.size(); ++k) {
      mesh->triangles.push_back({corners[k], corners[k + 1 + k % 2], corners[k + 2 - k % 2]});
    }
  } else if (type == kTetra) {
    fault = wants(4, 4);
    if (fault.empty()) {
      mesh->tets.push_back({corners[0], corners[1], corners[2], corners[3]});
    }
  } else {
    fault = "type " + std::to_string(type) +
            "; valid: 1 to 4 (points and lines), 5 to 7 (triangle, strip, polygon), 8 and 9 (pixel, quadrangle), 10 "
            "(tetrahedron). Split other cells, and save as first order";
  }
  return fault;
}

}  // namespace

void AddVtkCells(const VtkCells& cells, Index first_vertex, std::size_t vertex_count, const VtkFault& fail,
                 MeshFile* mesh) {
  if (cells.offsets.size() != cells.types.size() + 1) {
    fail(std::to_string(cells.types.size()) + " types of cells; valid: " + std::to_string(cells.offsets.size() - 1) +
         ", one a cell");
  }
  std::vector<Index> corners;
  for (std::size_t i = 0; i < cells.types.size(); ++i) {
    const std::int64_t begin = cells.offsets[i], end = cells.offsets[i + 1];
    if (begin < 0 || end < begin || static_cast<std::uint64_t>(end) > cells.connectivity.size()) {
      fail("cell " + std::to_string(i) + ": entries " + std::to_string(begin) + " to " + std::to_string(end) +
           "; valid: ascending, 0 to " + std::to_string(cells.connectivity.size()));
    }
    corners.clear();
    for (std::int64_t k = begin; k < end; ++k) {
      const std::int64_t vertex = cells.connectivity[static_cast<std::size_t>(k)];
      if (vertex < 0 || static_cast<std::uint64_t>(vertex) >= vertex_count) {
        fail("cell " + std::to_string(i) + ": vertex " + std::to_string(vertex) + "; valid: 0 to below " +
             std::to_string(vertex_count));
      }
      corners.push_back(first_vertex + static_cast<Index>(vertex));
    }
    const std::string fault = AddCell(cells.types[i], corners, mesh);
    if (!fault.empty()) {
      fail("cell " + std::to_string(i) + ": " + fault);
    }
  }
}

}  // namespace fulcrum::scene
