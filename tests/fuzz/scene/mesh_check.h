// Properties that must hold for any bytes that are read as a mesh.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>

#include "services/base/core/error.h"
#include "tests/unit/scene/mesh_samples.h"

namespace fulcrum::scene {

inline void Require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// True when `bytes` are a mesh. Aborts if they give an invalid mesh or are refused without the file's name.
inline bool CheckBytes(const MeshSample& sample, const std::string& bytes) {
  try {
    const MeshFile mesh = ParseSample(sample, bytes);
    Require(!mesh.triangles.empty() || !mesh.tets.empty());
    for (const Vec3d& p : mesh.vertices) {
      Require(p.allFinite());
    }
    for (const Triangle& t : mesh.triangles) {
      Require(t[0] < mesh.vertices.size() && t[1] < mesh.vertices.size() && t[2] < mesh.vertices.size());
    }
    for (const Tetrahedron& t : mesh.tets) {
      for (const Index v : t) {
        Require(v < mesh.vertices.size());
      }
    }
    (void)SurfaceOf(mesh);
    return true;
  } catch (const InputError& error) {
    Require(std::string(error.what()).starts_with("a."));
    return false;
  }
}

}  // namespace fulcrum::scene
