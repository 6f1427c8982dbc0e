#include "services/scene/compiler/tet_repair.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"

namespace fulcrum::scene {
namespace {

/// A flatter tetrahedron has no direction in which it resists, and would need an unusably small time step.
constexpr double kFlat_deg = 1.0;

/// A tetrahedron with its number in the file.
struct Numbered {
  Tetrahedron tet;
  std::size_t number;
};

std::string Place(const Vec3d& p) {
  char text[96];
  std::snprintf(text, sizeof(text), "(%.4g, %.4g, %.4g)", p.x(), p.y(), p.z());
  return text;
}

class TetRepair {
 public:
  TetRepair(const MeshFile& file, const std::string& name, TetRepairReport* report)
      : file_(file), name_(name), report_(report) {}

  TetrahedralMesh Run() {
    Merge();
    Turn();
    CheckShapes();
    KeepLargestPiece(Neighbours());
    return Compact();
  }

 private:
  [[noreturn]] void Refuse(const Numbered& t, const std::string& reason) const {
    throw FlawError(name_ + ": tetrahedron " + std::to_string(t.number) + " at " + Place(X(t.tet[0])) + ": " + reason);
  }

  const Vec3d& X(Index v) const { return file_.vertices[v]; }

  /// Merges vertices at one place, so that parts of a mesh that were written separately are connected again.
  void Merge() {
    std::map<std::array<double, 3>, Index> ids;
    std::vector<Index> first(file_.vertices.size());
    std::vector<bool> used(file_.vertices.size(), false);
    for (const Tetrahedron& t : file_.tets) {
      for (const Index v : t) {
        used[v] = true;
      }
    }
    for (Index v = 0; v < first.size(); ++v) {
      if (used[v]) {
        const auto [entry, is_new] = ids.try_emplace({X(v).x() + 0.0, X(v).y() + 0.0, X(v).z() + 0.0}, v);
        first[v] = entry->second;
        report_->vertices_merged += is_new ? 0 : 1;
      }
    }
    std::map<Tetrahedron, std::size_t> seen;
    for (std::size_t i = 0; i < file_.tets.size(); ++i) {
      Tetrahedron tet = file_.tets[i];
      std::transform(tet.begin(), tet.end(), tet.begin(), [&](Index v) { return first[v]; });
      Tetrahedron sorted = tet;
      std::sort(sorted.begin(), sorted.end());
      if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end() || !seen.try_emplace(sorted, i).second) {
        ++report_->doubles_dropped;
        continue;
      }
      tets_.push_back({tet, i});
    }
    if (tets_.empty()) {
      throw InputError(name_ + ": every tetrahedron has a corner twice");
    }
  }

  double Volume(const Tetrahedron& t) const { return SignedVolume(X(t[0]), X(t[1]), X(t[2]), X(t[3])); }

  void Turn() {
    for (Numbered& t : tets_) {
      if (Volume(t.tet) < 0) {
        std::swap(t.tet[2], t.tet[3]);
        ++report_->turned;
      }
    }
    // A file in which all tetrahedra have the other orientation needs no repair.
    report_->turned = report_->turned == tets_.size() ? 0 : report_->turned;
  }

  void CheckShapes() {
    report_->least_dihedral_deg = 180;
    for (const Numbered& t : tets_) {
      const DihedralRange range = DihedralAngles({X(t.tet[0]), X(t.tet[1]), X(t.tet[2]), X(t.tet[3])});
      if (!(Volume(t.tet) > 0) || !(range.least_deg >= kFlat_deg)) {
        char text[96];
        std::snprintf(text, sizeof(text), "is flat (least dihedral angle %.3g deg; valid: %g and above)",
                      range.least_deg, kFlat_deg);
        Refuse(t, text);
      }
      report_->least_dihedral_deg = std::min(report_->least_dihedral_deg, range.least_deg);
      report_->largest_dihedral_deg = std::max(report_->largest_dihedral_deg, range.largest_deg);
    }
  }

  /// Pairs of indices in `tets_` that share a face.
  std::vector<std::array<std::size_t, 2>> Neighbours() const {
    struct Face {
      Triangle sorted;
      std::size_t tet;
      bool is_odd;  ///< The sorted corners run clockwise, seen from outside.
    };
    // Corners of each face counter-clockwise from outside where the volume is positive.
    constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    std::vector<Face> faces;
    faces.reserve(4 * tets_.size());
    for (std::size_t i = 0; i < tets_.size(); ++i) {
      const Tetrahedron& t = tets_[i].tet;
      for (const auto& f : kFaces) {
        Triangle face{t[f[0]], t[f[1]], t[f[2]]};
        bool is_odd = false;
        for (const auto& [a, b] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{0, 1}}) {
          if (face[a] > face[b]) {
            std::swap(face[a], face[b]);
            is_odd = !is_odd;
          }
        }
        faces.push_back({face, i, is_odd});
      }
    }
    std::sort(faces.begin(), faces.end(),
              [](const Face& a, const Face& b) { return std::tie(a.sorted, a.tet) < std::tie(b.sorted, b.tet); });
    std::vector<std::array<std::size_t, 2>> pairs;
    for (std::size_t i = 0; i + 1 < faces.size(); ++i) {
      if (faces[i].sorted != faces[i + 1].sorted) {
        continue;
      }
      const std::string other = std::to_string(tets_[faces[i].tet].number);
      if (i + 2 < faces.size() && faces[i + 2].sorted == faces[i].sorted) {
        Refuse(tets_[faces[i + 2].tet], "shares one face with tetrahedra " + other + " and " +
                                            std::to_string(tets_[faces[i + 1].tet].number) +
                                            "; valid: with one other at most");
      }
      if (faces[i].is_odd == faces[i + 1].is_odd) {
        Refuse(tets_[faces[i + 1].tet],
               "lies on the same side of a face as tetrahedron " + other + " that shares it: the mesh is folded over");
      }
      pairs.push_back({faces[i].tet, faces[i + 1].tet});
    }
    return pairs;
  }

  void KeepLargestPiece(const std::vector<std::array<std::size_t, 2>>& pairs) {
    std::vector<std::size_t> parent(tets_.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](std::size_t i) {
      while (parent[i] != i) {
        i = parent[i] = parent[parent[i]];
      }
      return i;
    };
    for (const auto& [a, b] : pairs) {
      const std::size_t x = root(a), y = root(b);
      parent[std::max(x, y)] = std::min(x, y);
    }
    std::vector<double> volume(tets_.size(), 0);
    for (std::size_t i = 0; i < tets_.size(); ++i) {
      volume[root(i)] += Volume(tets_[i].tet);
    }
    const auto largest = static_cast<std::size_t>(std::max_element(volume.begin(), volume.end()) - volume.begin());
    std::vector<Numbered> kept;
    for (std::size_t i = 0; i < tets_.size(); ++i) {
      if (root(i) == largest) {
        kept.push_back(tets_[i]);
      }
      report_->pieces_dropped += parent[i] == i && i != largest ? 1 : 0;
    }
    tets_ = std::move(kept);
  }

  /// Sorts the vertices by place: neighbours in memory are then neighbours in space, whatever the order of the file.
  TetrahedralMesh Compact() const {
    std::vector<Index> used;
    for (const Numbered& t : tets_) {
      used.insert(used.end(), t.tet.begin(), t.tet.end());
    }
    std::sort(used.begin(), used.end(), [&](Index a, Index b) {
      return std::array{X(a).y(), X(a).z(), X(a).x()} < std::array{X(b).y(), X(b).z(), X(b).x()};
    });
    used.erase(std::unique(used.begin(), used.end()), used.end());
    TetrahedralMesh mesh;
    std::vector<Index> place(file_.vertices.size(), 0);
    for (const Index v : used) {
      place[v] = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.push_back(X(v));
    }
    for (const Numbered& t : tets_) {
      Tetrahedron tet;
      std::transform(t.tet.begin(), t.tet.end(), tet.begin(), [&](Index v) { return place[v]; });
      std::sort(tet.begin(), tet.end());
      const auto& x = mesh.vertices;
      if (SignedVolume(x[tet[0]], x[tet[1]], x[tet[2]], x[tet[3]]) < 0) {
        std::swap(tet[2], tet[3]);
      }
      mesh.tets.push_back(tet);
    }
    std::sort(mesh.tets.begin(), mesh.tets.end());
    return mesh;
  }

  const MeshFile& file_;
  const std::string& name_;
  TetRepairReport* report_;
  std::vector<Numbered> tets_;
};

}  // namespace

TetrahedralMesh RepairTetrahedra(const MeshFile& file, const std::string& name, TetRepairReport* report) {
  return TetRepair(file, name, report).Run();
}

}  // namespace fulcrum::scene
