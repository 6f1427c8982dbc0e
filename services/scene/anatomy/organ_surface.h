// What an import needs to know of a surface, and its file.
#pragma once

#include <string>

#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// Binary little-endian PLY, which keeps shared vertices. `mesh` is in millimetres.
[[nodiscard]] std::string Ply(const TriangleMesh& mesh);

/// Parts that share no vertex.
[[nodiscard]] int PiecesOf(const TriangleMesh& mesh);

/// Mean of the vertices.
[[nodiscard]] Vec3d MiddleOf(const TriangleMesh& mesh);

/// Volume that the surface encloses, negative if it is inside out. Of an open surface nearly: cones from its middle to
/// its openings are missing.
[[nodiscard]] double VolumeOf(const TriangleMesh& mesh);

[[nodiscard]] bool IsOpen(const TriangleMesh& mesh);

/// Turns a surface that is inside out, as programs write it that mirror objects: it would be seen, and stop tissue,
/// from inside only. False if it is not inside out, or encloses as little as a sheet. Neighbouring triangles must have
/// one sense.
bool TurnOutward(TriangleMesh* mesh);

/// Some vertex of one is nearer to a triangle of the other than `reach`.
[[nodiscard]] bool AreNear(const TriangleMesh& one, const TriangleMesh& other, double reach);

}  // namespace fulcrum::scene
