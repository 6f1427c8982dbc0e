#include "services/scene/readers/readers.h"

namespace fulcrum::scene {
namespace {

/// Reads the vertices and returns the number of the first: files count from 0 or from 1.
std::int64_t ReadNodes(Cursor* in, MeshFile* mesh) {
  in->set_comment('#');
  const std::size_t count = in->TakeCount<std::int64_t>("vertices", 4, 1);
  const auto dimension = in->Take<int>("the dimension");
  if (dimension != 3) {
    in->Fail("dimension " + std::to_string(dimension) + "; valid: 3");
  }
  // The numbers of attributes and markers on this line are not needed: the rest of each line is skipped.
  in->Line();
  mesh->vertices.reserve(count);
  std::int64_t first = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = in->Take<std::int64_t>("the number of a vertex");
    if (i == 0) {
      if (number != 0 && number != 1) {
        in->Fail("the first vertex has number " + std::to_string(number) + "; valid: 0 or 1");
      }
      first = number;
    }
    if (number != first + static_cast<std::int64_t>(i)) {
      in->Fail("vertex number " + std::to_string(number) +
               "; valid here: " + std::to_string(first + static_cast<std::int64_t>(i)));
    }
    const double x = in->TakeCoordinate<double>(), y = in->TakeCoordinate<double>(), z = in->TakeCoordinate<double>();
    mesh->vertices.emplace_back(x, y, z);
    in->Line();
  }
  return first;
}

template <std::size_t N>
void ReadElements(Cursor* in, std::size_t count, std::int64_t first, std::size_t vertex_count,
                  std::vector<std::array<Index, N>>* elements) {
  elements->reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    (void)in->Take<std::int64_t>("the number of an element");
    std::array<Index, N> element;
    for (Index& v : element) {
      v = in->CheckVertex(in->Take<std::int64_t>("a vertex"), first, vertex_count);
    }
    elements->push_back(element);
    in->Line();  // Attributes, markers, neighbours.
  }
}

}  // namespace

MeshFile ReadTetgen(std::string_view nodes, const std::string& nodes_name, std::string_view elements,
                    const std::string& elements_name, bool faces) {
  MeshFile mesh;
  Cursor node_file(nodes, nodes_name);
  const std::int64_t first = ReadNodes(&node_file, &mesh);
  Cursor in(elements, elements_name);
  in.set_comment('#');
  const std::size_t count = in.TakeCount<std::int64_t>(faces ? "faces" : "tetrahedra", faces ? 4 : 5, 1);
  if (faces) {
    in.Line();
    ReadElements(&in, count, first, mesh.vertices.size(), &mesh.triangles);
    return mesh;
  }
  const auto corners = in.Take<int>("the number of nodes of a tetrahedron");
  if (corners != 4) {
    in.Fail(std::to_string(corners) + " nodes a tetrahedron; valid: 4 (first order; 10 is second order)");
  }
  in.Line();
  ReadElements(&in, count, first, mesh.vertices.size(), &mesh.tets);
  return mesh;
}

}  // namespace fulcrum::scene
