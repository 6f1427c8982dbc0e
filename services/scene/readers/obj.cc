#include <vector>

#include "services/scene/readers/readers.h"

namespace fulcrum::scene {
namespace {

/// Converts "7", "7/1", "7//3" or "-1" (from the end) to a vertex index.
Index ToVertex(const Cursor& in, std::string_view word, std::size_t vertex_count) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || (end != word.data() + word.size() && *end != '/')) {
    in.Fail(Quote(word) + " where a vertex should be");
  }
  const auto count = static_cast<std::int64_t>(vertex_count);
  const bool from_end = number < 0 && number >= -count;
  return in.CheckVertex(from_end ? count + 1 + number : number, 1, vertex_count);
}

}  // namespace

MeshFile ReadObj(std::string_view bytes, const std::string& name) {
  MeshFile mesh;
  Cursor in(bytes, name);
  std::vector<Index> polygon;
  for (std::string_view word = in.Word(); !word.empty(); word = in.Word()) {
    if (word == "v") {
      const double x = in.TakeCoordinate<double>(), y = in.TakeCoordinate<double>(), z = in.TakeCoordinate<double>();
      mesh.vertices.emplace_back(x, y, z);
      in.Line();
    } else if (word == "f") {
      polygon.clear();
      for (word = in.WordOfLine(); !word.empty(); word = in.WordOfLine()) {
        polygon.push_back(ToVertex(in, word, mesh.vertices.size()));
      }
      AddPolygon(polygon, in, &mesh);
    } else if (word == "l" || word == "p") {
      ++mesh.skipped;
      in.Line();
    } else {
      in.Line();  // Normals, texture coordinates, groups, materials, comments: not needed.
    }
  }
  return mesh;
}

}  // namespace fulcrum::scene
