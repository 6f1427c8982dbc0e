#include "tests/unit/scene/mesh_writers.h"

namespace fulcrum::scene::writers {
namespace {

template <std::size_t N>
std::string Elements(const std::vector<std::array<Index, N>>& elements, int first, const char* head) {
  Out out(Out::kText);
  out << std::to_string(elements.size()) << head << "\n";
  for (std::size_t i = 0; i < elements.size(); ++i) {
    out.Put(static_cast<int>(i) + first);
    for (const Index v : elements[i]) {
      out.Put(static_cast<int>(v) + first);
    }
    out << "-1\n";
  }
  return out.bytes();
}

}  // namespace

std::string TetgenNodes(const std::vector<Vec3d>& points, int first) {
  Out out(Out::kText);
  out << "# a comment\n" << std::to_string(points.size()) << "  3  1  1\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.Put(static_cast<int>(i) + first).Point(points[i]) << "0.5 1  # attribute and marker\n";
  }
  return out.bytes();
}

std::string TetgenElements(const std::vector<Tetrahedron>& elements, int first, const char* head) {
  return Elements(elements, first, head);
}
std::string TetgenElements(const std::vector<Triangle>& elements, int first, const char* head) {
  return Elements(elements, first, head);
}

std::string Stl(const TriangleMesh& m, bool text) {
  Out out(text ? Out::kText : Out::kBinary);
  if (text) {
    out << "solid thing\n";
  } else {
    out << "solid, but binary" + std::string(63, ' ');
    out.Put(static_cast<std::uint32_t>(m.triangles.size()));
  }
  for (const Triangle& t : m.triangles) {
    out << (text ? "facet normal 0 0 0\n outer loop\n" : std::string(12, '\0'));
    for (const Index v : t) {
      out << (text ? "  vertex " : "");
      out.FloatPoint(m.vertices[v]).End();
    }
    out << (text ? " endloop\nendfacet\n" : std::string(2, '\0'));
  }
  out << (text ? "endsolid thing\n" : "");
  return out.bytes();
}

std::string Obj(const TriangleMesh& m) {
  Out out(Out::kText);
  out << "# a comment\nmtllib x\n";
  for (const Vec3d& p : m.vertices) {
    out << "v ";
    out.Point(p).End();
  }
  out << "vn 0 0 1\nl 1 2\n";
  bool from_end = false;
  for (const Triangle& t : m.triangles) {
    out << "f";
    for (const Index v : t) {
      const int number = from_end ? static_cast<int>(v) - static_cast<int>(m.vertices.size()) : static_cast<int>(v) + 1;
      out << " " << std::to_string(number) << (from_end ? "" : "//1");
    }
    out.End();
    from_end = !from_end;
  }
  return out.bytes();
}

std::string Off(const TriangleMesh& m) {
  Out out(Out::kText);
  out << "OFF  # a comment\n"
      << std::to_string(m.vertices.size()) << " " << std::to_string(m.triangles.size()) << " 0\n";
  for (const Vec3d& p : m.vertices) {
    out.Point(p) << "0.5 0.5 0.5\n";
  }
  for (const Triangle& t : m.triangles) {
    out.Put(3);
    for (const Index v : t) out.Put(v);
    out << "255 0 0\n";
  }
  return out.bytes();
}

std::string Vtp(const TriangleMesh& m) {
  Out out(Out::kText);
  out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
         "byte_order=\"LittleEndian\">\n<PolyData>\n"
      << "<Piece NumberOfPoints=\"" << std::to_string(m.vertices.size())
      << "\" NumberOfVerts=\"0\" NumberOfLines=\"1\" NumberOfStrips=\"0\" NumberOfPolys=\""
      << std::to_string(m.triangles.size()) << "\">\n"
      << "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n";
  for (const Vec3d& p : m.vertices) out.Point(p).End();
  out << "</DataArray></Points>\n<Lines><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1"
      << "</DataArray></Lines>\n<Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">\n";
  for (const Triangle& t : m.triangles) {
    for (const Index v : t) out.Put(v);
    out.End();
  }
  out << "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n";
  for (std::size_t i = 1; i <= m.triangles.size(); ++i) out.Put(3 * i).End();
  out << "</DataArray></Polys>\n</Piece></PolyData></VTKFile>\n";
  return out.bytes();
}

std::string Ply(const TriangleMesh& m, Out::Form form) {
  Out out(form);
  out << "ply\nformat "
      << (form == Out::kText     ? "ascii"
          : form == Out::kBinary ? "binary_little_endian"
                                 : "binary_big_endian")
      << " 1.0\ncomment x\nelement vertex " << std::to_string(m.vertices.size())
      << "\nproperty float x\nproperty uchar red\nproperty float y\nproperty float z\nelement other 1\nproperty list "
         "uchar short values\nelement face "
      << std::to_string(m.triangles.size()) << "\nproperty list uchar int vertex_indices\nproperty double area\n"
      << "end_header\n";
  for (const Vec3d& p : m.vertices) {
    out.Put(static_cast<float>(p.x())).Put(std::uint8_t{200}).Put(static_cast<float>(p.y()));
    out.Put(static_cast<float>(p.z())).End();
  }
  out.Put(std::uint8_t{2}).Put(std::int16_t{-5}).Put(std::int16_t{6}).End();
  for (const Triangle& t : m.triangles) {
    out.Put(std::uint8_t{3});
    for (const Index v : t) {
      out.Put(static_cast<std::int32_t>(v));
    }
    out.Put(0.25).End();
  }
  return out.bytes();
}

}  // namespace fulcrum::scene::writers
