#include "services/scene/mesh_io.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include "services/core/error.h"

namespace fulcrum::scene {
namespace {

constexpr std::size_t kStlHeaderBytes = 84;   ///< 80 bytes of text, 4 of count.
constexpr std::size_t kStlFacetBytes = 50;    ///< Normal and corners as 12 floats, 2 bytes of attributes.
constexpr double kLargestCoordinate = 1.0e6;  ///< Beyond: a broken file, in any unit.

[[noreturn]] void Refuse(const std::filesystem::path& name, const std::string& reason) {
  throw InputError(name.string() + ": " + reason);
}

/// Gives equal corners one vertex. STL knows no shared vertices, but writers repeat the same bits.
class Welder {
 public:
  explicit Welder(TriangleMesh* mesh) : mesh_(mesh) {}

  Index Add(const std::array<float, 3>& p) {
    // -0 and 0 are one place.
    const std::array<float, 3> key{p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f};
    const auto [entry, is_new] = ids_.try_emplace(key, static_cast<Index>(mesh_->vertices.size()));
    if (is_new) {
      mesh_->vertices.emplace_back(p[0], p[1], p[2]);
    }
    return entry->second;
  }

 private:
  TriangleMesh* mesh_;
  std::map<std::array<float, 3>, Index> ids_;
};

void CheckCoordinate(const std::filesystem::path& name, const char* what, std::size_t number, double value) {
  if (!(std::abs(value) <= kLargestCoordinate)) {
    Refuse(name, std::string(what) + " " + std::to_string(number) + ": coordinate " + std::to_string(value) +
                     " is not finite or beyond 1e6");
  }
}

TriangleMesh ParseBinaryStl(std::string_view bytes, std::size_t count, const std::filesystem::path& name) {
  TriangleMesh mesh;
  Welder welder(&mesh);
  mesh.triangles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 9> corners;
    std::memcpy(corners.data(), bytes.data() + kStlHeaderBytes + i * kStlFacetBytes + 12, sizeof(corners));
    for (const float x : corners) {
      CheckCoordinate(name, "facet", i, x);
    }
    mesh.triangles.push_back({welder.Add({corners[0], corners[1], corners[2]}),
                              welder.Add({corners[3], corners[4], corners[5]}),
                              welder.Add({corners[6], corners[7], corners[8]})});
  }
  return mesh;
}

/// Words of a text, with the line they stand on.
class Words {
 public:
  Words(std::string_view text, const std::filesystem::path& name) : text_(text), name_(name) {}

  /// Empty at the end.
  std::string_view Next() {
    while (at_ < text_.size() && IsBlank(text_[at_])) {
      line_ += text_[at_] == '\n' ? 1 : 0;
      ++at_;
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && !IsBlank(text_[at_])) {
      ++at_;
    }
    return text_.substr(begin, at_ - begin);
  }
  double Number() {
    std::string_view word = Next();
    if (word.starts_with('+')) {
      word.remove_prefix(1);
    }
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || error != std::errc() || end != word.data() + word.size()) {
      Fail("'" + std::string(word.substr(0, 40)) + "' where a number should be");
    }
    CheckCoordinate(name_, "line", line_, value);
    return value;
  }
  void SkipLine() { at_ = std::min(text_.find('\n', at_), text_.size()); }
  /// The words left on this line.
  std::vector<std::string_view> RestOfLine() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    Words rest(text_.substr(at_, end - at_), name_);
    std::vector<std::string_view> words;
    for (std::string_view word = rest.Next(); !word.empty(); word = rest.Next()) {
      words.push_back(word);
    }
    at_ = end;
    return words;
  }
  [[noreturn]] void Fail(const std::string& reason) const {
    Refuse(name_, "line " + std::to_string(line_) + ": " + reason);
  }

 private:
  static bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

  std::string_view text_;
  const std::filesystem::path& name_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

TriangleMesh ParseAsciiStl(std::string_view bytes, const std::filesystem::path& name) {
  TriangleMesh mesh;
  Welder welder(&mesh);
  Words words(bytes, name);
  std::array<Index, 3> corners;
  std::size_t corner_count = 0;
  bool ended = false;
  words.SkipLine();
  for (std::string_view word = words.Next(); !word.empty(); word = words.Next()) {
    if (word == "vertex") {
      const auto x = static_cast<float>(words.Number());
      const auto y = static_cast<float>(words.Number());
      const auto z = static_cast<float>(words.Number());
      if (corner_count == 3) {
        words.Fail("more than three corners in a facet");
      }
      corners[corner_count++] = welder.Add({x, y, z});
    } else if (word == "endfacet") {
      if (corner_count != 3) {
        words.Fail(std::to_string(corner_count) + " corners in a facet; valid: 3");
      }
      mesh.triangles.push_back(corners);
      corner_count = 0;
    } else if (word == "facet") {
      words.SkipLine();  // The normal follows from the corners.
    } else if (word == "endsolid") {
      ended = true;
      words.SkipLine();
    } else if (word == "solid") {
      ended = false;
      words.SkipLine();
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      words.Fail("unknown word '" + std::string(word.substr(0, 40)) + "'");
    }
  }
  if (!ended || corner_count != 0) {
    Refuse(name, "no 'endsolid' at the end: the file was cut short");
  }
  return mesh;
}

TriangleMesh ParseStl(std::string_view bytes, const std::filesystem::path& name) {
  // Some binary files begin with the word "solid" too: the size decides.
  if (bytes.size() >= kStlHeaderBytes) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, sizeof(count));
    if (bytes.size() == kStlHeaderBytes + static_cast<std::size_t>(count) * kStlFacetBytes) {
      if (count > kMaxMeshTriangles) {
        Refuse(name, std::to_string(count) + " triangles; valid: at most " + std::to_string(kMaxMeshTriangles));
      }
      return ParseBinaryStl(bytes, count, name);
    }
    if (!bytes.starts_with("solid")) {
      Refuse(name, "its count says " + std::to_string(count) + " triangles, its " + std::to_string(bytes.size()) +
                       " bytes hold " + std::to_string((bytes.size() - kStlHeaderBytes) / kStlFacetBytes) +
                       ": the file was cut short or is no STL");
    }
  }
  if (!bytes.starts_with("solid")) {
    Refuse(name, "neither a binary nor an ASCII STL");
  }
  return ParseAsciiStl(bytes, name);
}

/// "7", "7/1", "7//3" or "-1" (from the end) to a vertex.
Index ObjVertex(const Words& words, std::string_view word, std::size_t vertex_count) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || (end != word.data() + word.size() && *end != '/')) {
    words.Fail("'" + std::string(word.substr(0, 40)) + "' where a vertex should be");
  }
  const auto count = static_cast<std::int64_t>(vertex_count);
  const std::int64_t index = number > 0 ? number - 1 : count + number;
  if (number == 0 || index < 0 || index >= count) {
    words.Fail("vertex " + std::to_string(number) + "; valid: 1 to " + std::to_string(count) + " so far");
  }
  return static_cast<Index>(index);
}

TriangleMesh ParseObj(std::string_view bytes, const std::filesystem::path& name) {
  TriangleMesh mesh;
  Words words(bytes, name);
  for (std::string_view word = words.Next(); !word.empty(); word = words.Next()) {
    if (word == "v") {
      const double x = words.Number(), y = words.Number(), z = words.Number();
      mesh.vertices.emplace_back(x, y, z);
      words.SkipLine();
    } else if (word == "f") {
      std::vector<Index> polygon;
      for (const std::string_view corner : words.RestOfLine()) {
        polygon.push_back(ObjVertex(words, corner, mesh.vertices.size()));
      }
      if (polygon.size() < 3) {
        words.Fail("a face with fewer than three corners");
      }
      for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
        mesh.triangles.push_back({polygon[0], polygon[k], polygon[k + 1]});
      }
      if (mesh.triangles.size() > kMaxMeshTriangles) {
        words.Fail("more than " + std::to_string(kMaxMeshTriangles) + " triangles");
      }
    } else {
      words.SkipLine();  // Normals, texture coordinates, groups, materials, comments: not needed.
    }
  }
  return mesh;
}

}  // namespace

TriangleMesh ParseMesh(std::string_view bytes, const std::filesystem::path& name) {
  std::string extension = name.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  TriangleMesh mesh;
  if (extension == ".stl") {
    mesh = ParseStl(bytes, name);
  } else if (extension == ".obj") {
    mesh = ParseObj(bytes, name);
  } else {
    Refuse(name, "unknown mesh format '" + extension + "'; valid: .stl, .obj");
  }
  if (mesh.triangles.empty()) {
    Refuse(name, "holds no triangle");
  }
  return mesh;
}

TriangleMesh ReadMesh(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (!in && !in.eof()) {
    Refuse(file, "cannot be read");
  }
  return ParseMesh(bytes, file);
}

}  // namespace fulcrum::scene
