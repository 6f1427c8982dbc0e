// One reader for each family of mesh formats; ParseMesh() of mesh_io.h selects it. Each takes the file's bytes and its
// name for messages and throws InputError "file: place: value; what was expected".
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "services/scene/readers/cursor.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// Binary or ASCII; equal corners become one vertex. The size decides which, because some binary files begin with
/// "solid" too.
MeshFile ReadStl(std::string_view bytes, const std::string& name);
/// Whether the size is that of a binary STL with the number of triangles that its 81st to 84th byte say.
bool IsBinaryStl(std::string_view bytes);
/// Vertices and faces; everything else is omitted.
MeshFile ReadObj(std::string_view bytes, const std::string& name);
/// Text of vertices and faces, with or without colours or normals, which are omitted.
MeshFile ReadOff(std::string_view bytes, const std::string& name);
/// ASCII, binary little- or big-endian: elements `vertex` and `face`; other elements and properties are omitted.
MeshFile ReadPly(std::string_view bytes, const std::string& name);
/// Versions 1, 2.0 to 2.2 and 4.1, ASCII and binary (of either byte order).
MeshFile ReadGmsh(std::string_view bytes, const std::string& name);
/// Legacy files of versions 1 to 5, ASCII and binary: polygonal data and unstructured grids.
MeshFile ReadVtk(std::string_view bytes, const std::string& name);
/// XML unstructured grids (.vtu) and polygonal data (.vtp): ASCII, base64 inline, appended raw or base64; plain or
/// zlib-compressed.
MeshFile ReadVtu(std::string_view bytes, const std::string& name);
/// Nodes of a .node file and either the tetrahedra of an .ele file or the triangles of a .face file.
MeshFile ReadTetgen(std::string_view nodes, const std::string& nodes_name, std::string_view elements,
                    const std::string& elements_name, bool faces);

/// Adds a convex polygon as a fan of triangles; throws through `cursor` if it has fewer than three corners.
void AddPolygon(std::span<const Index> corners, const Cursor& cursor, MeshFile* mesh);

}  // namespace fulcrum::scene
