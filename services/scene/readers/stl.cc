#include <array>
#include <cstring>
#include <map>

#include "services/scene/readers/readers.h"

namespace fulcrum::scene {
namespace {

constexpr std::size_t kHeaderBytes = 84;         ///< 80 bytes of text, 4 of count.
constexpr std::size_t kFacetBytes = 50;          ///< Normal and corners as 12 floats, 2 bytes of attributes.
constexpr std::size_t kFacetBeforeCorners = 12;  ///< The normal, which follows from the corners.
constexpr std::size_t kFacetAfterCorners = 2;

/// Merges equal corners into one vertex. STL has no shared vertices, but writers repeat the same bits.
class Welder {
 public:
  explicit Welder(MeshFile* mesh) : mesh_(mesh) {}

  Index Add(const std::array<float, 3>& p) {
    // -0 and 0 are the same place.
    const std::array<float, 3> key{p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f};
    const auto [entry, is_new] = ids_.try_emplace(key, static_cast<Index>(mesh_->vertices.size()));
    if (is_new) {
      mesh_->vertices.emplace_back(p[0], p[1], p[2]);
    }
    return entry->second;
  }

 private:
  MeshFile* mesh_;
  std::map<std::array<float, 3>, Index> ids_;
};

std::array<float, 3> TakeCorner(Cursor* in) {
  std::array<float, 3> corner;
  for (float& x : corner) {
    x = static_cast<float>(in->TakeCoordinate<float>());
  }
  return corner;
}

MeshFile ReadBinary(Cursor* in, std::size_t count) {
  MeshFile mesh;
  Welder welder(&mesh);
  mesh.triangles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    in->Skip(kFacetBeforeCorners, "a normal");
    Triangle triangle;
    for (Index& v : triangle) {
      v = welder.Add(TakeCorner(in));
    }
    in->Skip(kFacetAfterCorners, "a facet's attributes");
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

MeshFile ReadAscii(Cursor* in) {
  MeshFile mesh;
  Welder welder(&mesh);
  Triangle corners;
  std::size_t corner_count = 0;
  bool ended = false;
  in->Line();
  for (std::string_view word = in->Word(); !word.empty(); word = in->Word()) {
    if (word == "vertex") {
      const std::array<float, 3> corner = TakeCorner(in);
      if (corner_count == 3) {
        in->Fail("more than three corners in a facet");
      }
      corners[corner_count++] = welder.Add(corner);
    } else if (word == "endfacet") {
      if (corner_count != 3) {
        in->Fail(std::to_string(corner_count) + " corners in a facet; valid: 3");
      }
      mesh.triangles.push_back(corners);
      corner_count = 0;
    } else if (word == "facet") {
      in->Line();
    } else if (word == "end") {
      in->Expect("solid");  // Some writers separate the words.
      ended = true;
      in->Line();
    } else if (word == "endsolid" || word == "solid") {
      ended = word == "endsolid";
      in->Line();
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      in->Fail("unknown word " + Quote(word) + "; valid: facet, outer loop, vertex, endloop, endfacet, endsolid");
    }
  }
  if (!ended || corner_count != 0) {
    in->Fail("no 'endsolid' at the end: the file was cut short");
  }
  return mesh;
}

}  // namespace

bool IsBinaryStl(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return false;
  std::uint32_t count;
  std::memcpy(&count, bytes.data() + kHeaderBytes - sizeof(count), sizeof(count));
  return bytes.size() == kHeaderBytes + static_cast<std::size_t>(count) * kFacetBytes;
}

MeshFile ReadStl(std::string_view bytes, const std::string& name) {
  Cursor in(bytes, name);
  if (bytes.size() >= kHeaderBytes) {
    in.SetBinary(false);
    in.Skip(kHeaderBytes - sizeof(std::uint32_t), "the header");
    const auto count = in.Take<std::uint32_t>("the number of triangles");
    if (IsBinaryStl(bytes)) {
      in.CheckCount("triangles", count, 1, kFacetBytes);
      return ReadBinary(&in, count);
    }
    if (!bytes.starts_with("solid")) {
      in.Fail("its count is " + std::to_string(count) + " triangles, but its " + std::to_string(bytes.size()) +
              " bytes contain " + std::to_string((bytes.size() - kHeaderBytes) / kFacetBytes) +
              ": the file was cut short or is no STL");
    }
  }
  if (!bytes.starts_with("solid")) {
    RefuseMesh(name,
               "line 1: " + Quote(bytes) + " begins neither a binary (84 bytes or more) nor an ASCII STL ('solid')");
  }
  Cursor text(bytes, name);
  return ReadAscii(&text);
}

}  // namespace fulcrum::scene
