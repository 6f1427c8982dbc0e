#include <vector>

#include "services/scene/readers/readers.h"

namespace fulcrum::scene {

MeshFile ReadOff(std::string_view bytes, const std::string& name) {
  Cursor in(bytes, name);
  in.set_comment('#');
  const std::string_view head = in.Word();
  if (head != "OFF" && head != "COFF" && head != "NOFF") {
    in.Fail(Quote(head) + " where OFF, COFF or NOFF should be");
  }
  if (bytes.substr(in.at()).starts_with(" BINARY")) {
    in.Fail("a binary OFF file is not read; write it as text");
  }
  // Each vertex needs three words, each face at least four.
  const auto vertex_count = in.TakeCount<std::int64_t>("vertices", 3, 6);
  const auto face_count = in.TakeCount<std::int64_t>("faces", 4, 8);
  (void)in.Take<std::int64_t>("the number of edges");
  MeshFile mesh;
  mesh.vertices.reserve(vertex_count);
  for (std::size_t i = 0; i < vertex_count; ++i) {
    const double x = in.TakeCoordinate<double>(), y = in.TakeCoordinate<double>(), z = in.TakeCoordinate<double>();
    mesh.vertices.emplace_back(x, y, z);
    in.Line();  // Colours or a normal.
  }
  std::vector<Index> polygon;
  for (std::size_t i = 0; i < face_count; ++i) {
    polygon.clear();
    const auto corners = in.TakeCount<std::int64_t>("corners", 1, 2);
    for (std::size_t k = 0; k < corners; ++k) {
      polygon.push_back(in.CheckVertex(in.Take<std::int64_t>("a vertex"), 0, vertex_count));
    }
    AddPolygon(polygon, in, &mesh);
    in.Line();  // Colours.
  }
  return mesh;
}

}  // namespace fulcrum::scene
