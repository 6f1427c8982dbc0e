// Writers of the mesh formats, for the samples: each gives the bytes of a file.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene::writers {

/// Writes values as text or as bytes in either order.
class Out {
 public:
  enum Form { kText, kBinary, kSwapped };
  explicit Out(Form form) : form_(form) {}

  Out& operator<<(const char* text) {
    bytes_ += text;
    return *this;
  }
  Out& operator<<(const std::string& text) {
    bytes_ += text;
    return *this;
  }
  template <class T>
  Out& Put(T value) {
    if (form_ == kText) {
      std::ostringstream text;
      text.precision(17);
      text << +value << ' ';
      bytes_ += text.str();
      return *this;
    }
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof(T));
    if (form_ == kSwapped) {
      std::reverse(raw.begin(), raw.end());
    }
    bytes_.append(raw.data(), raw.size());
    return *this;
  }
  Out& Point(const Vec3d& p) { return Put(p.x()).Put(p.y()).Put(p.z()); }
  Out& FloatPoint(const Vec3d& p) {
    return Put(static_cast<float>(p.x())).Put(static_cast<float>(p.y())).Put(static_cast<float>(p.z()));
  }
  /// End of a line in text, nothing in binary data.
  Out& End() { return form_ == kText ? *this << "\n" : *this; }
  [[nodiscard]] bool text() const { return form_ == kText; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  Form form_;
  std::string bytes_;
};

std::string Gmsh1(const MeshFile& m);
std::string Gmsh22(const MeshFile& m, Out::Form form);
std::string Gmsh41(const MeshFile& m, Out::Form form);

std::string VtkGrid(const MeshFile& m, bool is_5, Out::Form form);
std::string VtkPoly(const TriangleMesh& m, bool is_5, Out::Form form);

struct VtuVariant {
  bool inline_text = false, raw = false, appended = false, compressed = false, long_header = false, swapped = false;
};

std::string Vtu(const MeshFile& m, const VtuVariant& v);

/// @param first number of the first node. @param head text after the count in the first line.
std::string TetgenNodes(const std::vector<Vec3d>& points, int first);
std::string TetgenElements(const std::vector<Tetrahedron>& elements, int first, const char* head);
std::string TetgenElements(const std::vector<Triangle>& elements, int first, const char* head);

std::string Stl(const TriangleMesh& m, bool text);
std::string Obj(const TriangleMesh& m);
std::string Off(const TriangleMesh& m);
/// VTK XML polygonal data, as text.
std::string Vtp(const TriangleMesh& m);
std::string Ply(const TriangleMesh& m, Out::Form form);

}  // namespace fulcrum::scene::writers
