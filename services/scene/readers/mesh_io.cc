#include "services/scene/readers/mesh_io.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include "services/scene/builder/geometry.h"
#include "services/scene/readers/readers.h"

namespace fulcrum::scene {
namespace {

std::string BytesOf(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) {
    RefuseMesh(file.string(), "cannot be read (" + error.message() + ")");
  }
  if (size > kMaxMeshBytes) {
    RefuseMesh(file.string(),
               std::to_string(size) + " bytes; valid: at most " + std::to_string(kMaxMeshBytes) + " in a mesh file");
  }
  std::ifstream in(file, std::ios::binary);
  std::string bytes(size, '\0');
  if (!in.read(bytes.data(), static_cast<std::streamsize>(size))) {
    RefuseMesh(file.string(), "cannot be read");
  }
  return bytes;
}

std::string LowerExtension(const std::filesystem::path& name) {
  std::string extension = name.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

MeshFile ParseTetgen(std::string_view bytes, const std::filesystem::path& name, const std::string& extension,
                     const CompanionFiles& companions) {
  const auto beside = [&](const char* other) {
    return companions ? companions(std::filesystem::path(name).replace_extension(other)) : std::nullopt;
  };
  const auto sibling = [&](const char* other) { return std::filesystem::path(name).replace_extension(other).string(); };
  if (extension != ".node") {
    const auto nodes = beside(".node");
    if (!nodes) {
      RefuseMesh(name.string(), "needs " + sibling(".node") + " beside it, which is not there");
    }
    return ReadTetgen(*nodes, sibling(".node"), bytes, name.string(), extension == ".face");
  }
  if (const auto tets = beside(".ele")) {
    return ReadTetgen(bytes, name.string(), *tets, sibling(".ele"), false);
  }
  if (const auto faces = beside(".face")) {
    return ReadTetgen(bytes, name.string(), *faces, sibling(".face"), true);
  }
  RefuseMesh(name.string(), "needs " + sibling(".ele") + " or " + sibling(".face") + " beside it; neither is there");
}

MeshFile Choose(std::string_view bytes, const std::filesystem::path& name, const CompanionFiles& companions) {
  const std::string text = name.string(), extension = LowerExtension(name);
  const std::string_view head = bytes.substr(0, std::min<std::size_t>(bytes.size(), 512));
  // Content before extension, since files are renamed. But the 80 bytes before the count of a binary STL can have any
  // content.
  if (extension == ".stl" && IsBinaryStl(bytes)) {
    return ReadStl(bytes, text);
  }
  if (head.starts_with("$MeshFormat") || head.starts_with("$NOD") || head.starts_with("$Comments")) {
    return ReadGmsh(bytes, text);
  }
  if (head.starts_with("# vtk DataFile")) {
    return ReadVtk(bytes, text);
  }
  if (head.find("<VTKFile") != std::string_view::npos) {
    return ReadVtu(bytes, text);
  }
  if (head.starts_with("ply\n") || head.starts_with("ply\r\n")) {
    return ReadPly(bytes, text);
  }
  if (head.starts_with("OFF") || head.starts_with("COFF") || head.starts_with("NOFF")) {
    return ReadOff(bytes, text);
  }
  using Reader = MeshFile (*)(std::string_view, const std::string&);
  static const std::map<std::string, Reader> kByExtension = {{".stl", ReadStl}, {".msh", ReadGmsh}, {".vtk", ReadVtk},
                                                             {".vtu", ReadVtu}, {".vtp", ReadVtu},  {".ply", ReadPly},
                                                             {".obj", ReadObj}, {".off", ReadOff}};
  if (const auto reader = kByExtension.find(extension); reader != kByExtension.end()) {
    return reader->second(bytes, text);
  }
  if (extension == ".node" || extension == ".ele" || extension == ".face") {
    return ParseTetgen(bytes, name, extension, companions);
  }
  if (head.starts_with("solid")) {
    return ReadStl(bytes, text);
  }
  RefuseMesh(text, "unknown mesh format '" + extension +
                       "'; valid: .msh, .vtk, .vtu, .vtp, .node, .ele, .face, .stl, .obj, .off, .ply");
}

}  // namespace

void AddPolygon(std::span<const Index> corners, const Cursor& cursor, MeshFile* mesh) {
  if (corners.size() < 3) {
    cursor.Fail("a face of " + std::to_string(corners.size()) + " corners; valid: at least 3");
  }
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    mesh->triangles.push_back({corners[0], corners[k], corners[k + 1]});
  }
}

MeshFile ParseMesh(std::string_view bytes, const std::filesystem::path& name, const CompanionFiles& companions) {
  MeshFile mesh = Choose(bytes, name, companions);
  if (mesh.triangles.empty() && mesh.tets.empty()) {
    RefuseMesh(name.string(), "holds neither a triangle nor a tetrahedron (" + std::to_string(mesh.vertices.size()) +
                                  " vertices, " + std::to_string(mesh.skipped) + " points and lines)");
  }
  return mesh;
}

MeshFile ReadMesh(const std::filesystem::path& file) {
  return ParseMesh(BytesOf(file), file, [](const std::filesystem::path& other) -> std::optional<std::string> {
    std::error_code error;  // A name that is too long is no file either.
    if (!std::filesystem::is_regular_file(other, error)) {
      return std::nullopt;
    }
    return BytesOf(other);
  });
}

TriangleMesh SurfaceOf(MeshFile mesh) {
  if (mesh.tets.empty()) {
    return {std::move(mesh.vertices), std::move(mesh.triangles)};
  }
  // Files differ in the orientation of a tetrahedron.
  for (Tetrahedron& t : mesh.tets) {
    const auto& x = mesh.vertices;
    if (SignedVolume(x[t[0]], x[t[1]], x[t[2]], x[t[3]]) < 0) {
      std::swap(t[2], t[3]);
    }
  }
  std::vector<Triangle> boundary = BoundaryOf(mesh.tets);
  return {std::move(mesh.vertices), std::move(boundary)};
}

}  // namespace fulcrum::scene
