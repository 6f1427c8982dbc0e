#include "tests/unit/scene/mesh_samples.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <sstream>

namespace fulcrum::scene {
namespace {

constexpr int kFirstTag = 7, kTagStep = 3;  ///< Gmsh's node numbers need not follow one another.
int Tag(Index v) { return kFirstTag + kTagStep * static_cast<int>(v); }

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
  /// A line's end in text, nothing in binary data.
  Out& End() { return form_ == kText ? *this << "\n" : *this; }
  [[nodiscard]] bool text() const { return form_ == kText; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  Form form_;
  std::string bytes_;
};

// --------------------------------------------------------------------------------------------------------- Gmsh

std::string Gmsh1(const MeshFile& m) {
  Out out(Out::kText);
  out << "$NOD\n" << std::to_string(m.vertices.size()) << "\n";
  for (Index v = 0; v < m.vertices.size(); ++v) {
    out.Put(Tag(v)).Point(m.vertices[v]).End();
  }
  out << "$ENDNOD\n$ELM\n" << std::to_string(m.tets.size() + 2) << "\n1 15 0 1 1 7\n2 1 0 1 2 7 10\n";
  for (const Tetrahedron& t : m.tets) {
    out << "9 4 1 1 4 ";
    for (const Index v : t) {
      out.Put(Tag(v));
    }
    out.End();
  }
  out << "$ENDELM\n";
  return out.bytes();
}

std::string GmshHead(const char* version, Out* out) {
  *out << "$MeshFormat\n" << version << (out->text() ? " 0 8\n" : " 1 8\n");
  if (!out->text()) {
    out->Put(std::int32_t{1}) << "\n";
  }
  *out << "$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"wall\"\n$EndPhysicalNames\n";
  return {};
}

std::string Gmsh22(const MeshFile& m, Out::Form form) {
  Out out(form);
  GmshHead("2.2", &out);
  out << "$Nodes\n" << std::to_string(m.vertices.size()) << "\n";
  for (Index v = 0; v < m.vertices.size(); ++v) {
    out.Put(Tag(v)).Point(m.vertices[v]).End();
  }
  out << "\n$EndNodes\n$Elements\n" << std::to_string(m.tets.size() + 1) << "\n";
  const auto element = [&](int number, int kind, bool head, int block) {
    if (out.text()) {
      out.Put(number).Put(kind).Put(2).Put(1).Put(1);
      return;
    }
    if (head) {
      out.Put(kind).Put(block).Put(2);
    }
    out.Put(number).Put(1).Put(1);
  };
  element(1, 1, true, 1);
  out.Put(Tag(0)).Put(Tag(1)).End();
  for (std::size_t i = 0; i < m.tets.size(); ++i) {
    element(static_cast<int>(i) + 2, 4, i == 0, static_cast<int>(m.tets.size()));
    for (const Index v : m.tets[i]) {
      out.Put(Tag(v));
    }
    out.End();
  }
  out << "\n$EndElements\n$NodeData\nskipped\n$EndNodeData\n";
  return out.bytes();
}

std::string Gmsh41(const MeshFile& m, Out::Form form) {
  using U = std::uint64_t;
  using I = std::int32_t;
  Out out(form);
  GmshHead("4.1", &out);
  const U n = m.vertices.size();
  // Two blocks of nodes, the first on a parametric curve; two of elements.
  out << "$Nodes\n";
  out.Put(U{2}).Put(n).Put(U{7}).Put(static_cast<U>(Tag(static_cast<Index>(n - 1)))).End();
  out.Put(I{1}).Put(I{1}).Put(I{1}).Put(U{2}).End();
  out.Put(static_cast<U>(Tag(0))).End().Put(static_cast<U>(Tag(1))).End();
  out.Point(m.vertices[0]).Put(0.5).End().Point(m.vertices[1]).Put(0.75).End();
  out.Put(I{3}).Put(I{1}).Put(I{0}).Put(n - 2).End();
  for (Index v = 2; v < n; ++v) {
    out.Put(static_cast<U>(Tag(v))).End();
  }
  for (Index v = 2; v < n; ++v) {
    out.Point(m.vertices[v]).End();
  }
  out << "\n$EndNodes\n$Elements\n";
  const U tets = m.tets.size();
  out.Put(U{2}).Put(tets + 1).Put(U{1}).Put(tets + 1).End();
  out.Put(I{0}).Put(I{1}).Put(I{15}).Put(U{1}).End();
  out.Put(U{1}).Put(static_cast<U>(Tag(0))).End();
  out.Put(I{3}).Put(I{1}).Put(I{4}).Put(tets).End();
  for (U i = 0; i < tets; ++i) {
    out.Put(i + 2);
    for (const Index v : m.tets[i]) {
      out.Put(static_cast<U>(Tag(v)));
    }
    out.End();
  }
  out << "\n$EndElements\n";
  return out.bytes();
}

// ---------------------------------------------------------------------------------------------------------- VTK

std::string VtkHead(const char* version, const char* set, const Out& out) {
  return std::string("# vtk DataFile Version ") + version + "\ntitle\n" + (out.text() ? "ASCII" : "BINARY") +
         "\nDATASET " + set + "\n";
}

void VtkPoints(const std::vector<Vec3d>& points, bool floats, Out* out) {
  *out << "POINTS " << std::to_string(points.size()) << (floats ? " float\n" : " double\n");
  for (const Vec3d& p : points) {
    (floats ? out->FloatPoint(p) : out->Point(p)).End();
  }
  *out << "\nMETADATA\nINFORMATION 0\n\n";
}

template <std::size_t N>
void VtkCells1(const char* keyword, const std::vector<std::array<Index, N>>& cells, bool line, Out* out) {
  const std::size_t count = cells.size() + (line ? 1 : 0);
  *out << keyword << " " << std::to_string(count) << " " << std::to_string(cells.size() * (N + 1) + (line ? 3 : 0))
       << "\n";
  if (line) {
    out->Put(std::int32_t{2}).Put(std::int32_t{0}).Put(std::int32_t{1}).End();
  }
  for (const auto& cell : cells) {
    out->Put(static_cast<std::int32_t>(N));
    for (const Index v : cell) {
      out->Put(static_cast<std::int32_t>(v));
    }
    out->End();
  }
  *out << "\n";
}

template <std::size_t N>
void VtkCells5(const char* keyword, const std::vector<std::array<Index, N>>& cells, Out* out) {
  *out << keyword << " " << std::to_string(cells.size() + 1) << " " << std::to_string(cells.size() * N)
       << "\nOFFSETS vtktypeint64\n";
  for (std::size_t i = 0; i <= cells.size(); ++i) {
    out->Put(static_cast<std::int64_t>(i * N));
  }
  *out << "\nCONNECTIVITY vtktypeint64\n";
  for (const auto& cell : cells) {
    for (const Index v : cell) {
      out->Put(static_cast<std::int64_t>(v));
    }
  }
  *out << "\n";
}

std::string VtkGrid(const MeshFile& m, bool is_5, Out::Form form) {
  Out out(form);
  out << VtkHead(is_5 ? "5.1" : "3.0", "UNSTRUCTURED_GRID", out);
  out << "FIELD FieldData 1\nTIME 1 1 double\n";
  out.Put(0.5) << "\n";
  VtkPoints(m.vertices, false, &out);
  is_5 ? VtkCells5("CELLS", m.tets, &out) : VtkCells1("CELLS", m.tets, true, &out);
  out << "CELL_TYPES " << std::to_string(m.tets.size() + (is_5 ? 0 : 1)) << "\n";
  if (!is_5) {
    out.Put(std::int32_t{3});
  }
  for (std::size_t i = 0; i < m.tets.size(); ++i) {
    out.Put(std::int32_t{10});
  }
  out << "\nPOINT_DATA 5\nSCALARS x float\n";
  return out.bytes();
}

std::string VtkPoly(const TriangleMesh& m, bool is_5, Out::Form form) {
  Out out(form);
  out << VtkHead(is_5 ? "5.1" : "4.2", "POLYDATA", out);
  VtkPoints(m.vertices, true, &out);
  is_5 ? VtkCells5("POLYGONS", m.triangles, &out) : VtkCells1("POLYGONS", m.triangles, false, &out);
  return out.bytes();
}

// ---------------------------------------------------------------------------------------------------------- VTU

struct VtuVariant {
  bool inline_text = false, raw = false, appended = false, compressed = false, long_header = false, swapped = false;
};

std::string Base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

std::string VtuSize(std::uint64_t size, const VtuVariant& v) {
  Out out(v.swapped ? Out::kSwapped : Out::kBinary);
  v.long_header ? out.Put(size) : out.Put(static_cast<std::uint32_t>(size));
  return out.bytes();
}

/// Appended: two blocks, the second one shorter. Inline: one, announced as large as writers usually make them, which
/// is more than there is. Header and data are padded apart as VTK's own writer does.
std::string VtuCompressed(const std::string& data, const VtuVariant& v) {
  const std::size_t block = v.appended ? data.size() / 2 + 1 : 32768;
  const std::vector<std::string> parts =
      v.appended ? std::vector{data.substr(0, block), data.substr(block)} : std::vector{data};
  std::string header = VtuSize(parts.size(), v) + VtuSize(block, v) + VtuSize(parts.back().size(), v), packed;
  for (const std::string& part : parts) {
    std::string out(compressBound(part.size()), '\0');
    uLongf size = out.size();
    compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(part.data()), part.size());
    packed += out.substr(0, size);
    header += VtuSize(size, v);
  }
  return v.raw ? header + packed : Base64(header) + Base64(packed);
}

std::string Vtu(const MeshFile& m, const VtuVariant& v) {
  std::string xml, appended;
  const auto array = [&](const char* name, const char* type, const char* more, const auto& write) {
    Out out(v.inline_text ? Out::kText : v.swapped ? Out::kSwapped : Out::kBinary);
    write(&out);
    xml += std::string("<DataArray Name=\"") + name + "\" type='" + type + "' " + more;
    const std::string plain = VtuSize(out.bytes().size(), v) + out.bytes();
    const std::string packed = v.inline_text  ? out.bytes()
                               : v.compressed ? VtuCompressed(out.bytes(), v)
                               : v.raw        ? plain
                                              : Base64(plain);
    if (v.appended) {
      xml += " format=\"appended\" offset=\"" + std::to_string(appended.size()) + "\"/>\n";
      appended += packed;
    } else {
      xml += std::string(" format=\"") + (v.inline_text ? "ascii" : "binary") + "\">\n  " + packed + "\n</DataArray>\n";
    }
  };
  xml += "<?xml version=\"1.0\"?>\n<!-- a <comment> -->\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\"";
  xml += std::string(" byte_order=\"") + (v.swapped ? "BigEndian" : "LittleEndian") + "\"";
  xml += v.long_header ? " header_type=\"UInt64\"" : " header_type=\"UInt32\"";
  xml += v.compressed ? " compressor=\"vtkZLibDataCompressor\">\n" : ">\n";
  xml += "<UnstructuredGrid>\n<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>\n<Piece NumberOfPoints=\"" +
         std::to_string(m.vertices.size()) + "\" NumberOfCells=\"" + std::to_string(m.tets.size() + 1) + "\">\n";
  xml += "<PointData>\n";
  array("connectivity", "Float32", "", [](Out* out) { out->Put(1.0f); });
  xml += "</PointData>\n<Points>\n";
  array("Points", "Float64", "NumberOfComponents=\"3\"", [&](Out* out) {
    for (const Vec3d& p : m.vertices) {
      out->Point(p);
    }
  });
  xml += "</Points>\n<Cells>\n";
  array("connectivity", "Int64", "", [&](Out* out) {
    out->Put(std::int64_t{0}).Put(std::int64_t{1});
    for (const Tetrahedron& t : m.tets) {
      for (const Index i : t) {
        out->Put(static_cast<std::int64_t>(i));
      }
    }
  });
  array("offsets", "UInt32", "", [&](Out* out) {
    for (std::uint32_t i = 0; i <= m.tets.size(); ++i) {
      out->Put(2 + 4 * i);
    }
  });
  array("types", "UInt8", "", [&](Out* out) {
    out->Put(std::uint8_t{3});
    for (std::size_t i = 0; i < m.tets.size(); ++i) {
      out->Put(std::uint8_t{10});
    }
  });
  xml += "</Cells>\n</Piece>\n</UnstructuredGrid>\n";
  if (v.appended) {
    xml += std::string("<AppendedData encoding=\"") + (v.raw ? "raw" : "base64") + "\">\n_" + appended +
           "\n</AppendedData>\n";
  }
  return xml + "</VTKFile>\n";
}

// ------------------------------------------------------------------------------------------- TetGen, STL, OBJ, PLY

std::string TetgenNodes(const std::vector<Vec3d>& points, int first) {
  Out out(Out::kText);
  out << "# a comment\n" << std::to_string(points.size()) << "  3  1  1\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.Put(static_cast<int>(i) + first).Point(points[i]) << "0.5 1  # attribute and marker\n";
  }
  return out.bytes();
}

template <std::size_t N>
std::string TetgenElements(const std::vector<std::array<Index, N>>& elements, int first, const char* head) {
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

}  // namespace

MeshFile SampleTets() {
  MeshFile mesh;
  mesh.vertices = {{0, 0, 0}, {1.5, 0, -0.125}, {0, 2.25, 0}, {0.5, 0.5, 3}, {0.25, 0.5, -2.75}};
  mesh.tets = {{0, 1, 2, 3}, {0, 1, 2, 4}};
  return mesh;
}

TriangleMesh SampleSurface() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1.5, 0, -0.125}, {0, 2.25, 0}, {0.5, 0.5, 3}, {0.25, 0.5, -2.75}};
  mesh.triangles = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}};
  return mesh;
}

std::vector<MeshSample> MeshSamples() {
  const MeshFile tets = SampleTets();
  const TriangleMesh surface = SampleSurface();
  std::vector<MeshSample> samples;
  const auto add = [&](const char* label, const char* name, std::string bytes, bool has_tets) {
    samples.push_back({label, name, std::move(bytes), {}, has_tets});
  };
  add("gmsh1", "a.msh", Gmsh1(tets), true);
  add("gmsh22_ascii", "a.msh", Gmsh22(tets, Out::kText), true);
  add("gmsh22_binary", "a.msh", Gmsh22(tets, Out::kBinary), true);
  add("gmsh22_binary_swapped", "a.msh", Gmsh22(tets, Out::kSwapped), true);
  add("gmsh41_ascii", "a.msh", Gmsh41(tets, Out::kText), true);
  add("gmsh41_binary", "a.msh", Gmsh41(tets, Out::kBinary), true);
  add("gmsh41_binary_swapped", "a.msh", Gmsh41(tets, Out::kSwapped), true);
  // VTK's legacy files hold the most significant byte first.
  add("vtk_grid_ascii", "a.vtk", VtkGrid(tets, false, Out::kText), true);
  add("vtk_grid_binary", "a.vtk", VtkGrid(tets, false, Out::kSwapped), true);
  add("vtk5_grid_ascii", "a.vtk", VtkGrid(tets, true, Out::kText), true);
  add("vtk5_grid_binary", "a.vtk", VtkGrid(tets, true, Out::kSwapped), true);
  add("vtk_poly_ascii", "a.vtk", VtkPoly(surface, false, Out::kText), false);
  add("vtk_poly_binary", "a.vtk", VtkPoly(surface, false, Out::kSwapped), false);
  add("vtk5_poly_ascii", "a.vtk", VtkPoly(surface, true, Out::kText), false);
  add("vtk5_poly_binary", "a.vtk", VtkPoly(surface, true, Out::kSwapped), false);
  VtuVariant v;
  v.inline_text = true;
  add("vtu_ascii", "a.vtu", Vtu(tets, v), true);
  v.inline_text = false;
  add("vtu_base64", "a.vtu", Vtu(tets, v), true);
  v.long_header = true;
  add("vtu_base64_long_header", "a.vtu", Vtu(tets, v), true);
  v.compressed = true;
  add("vtu_base64_zlib", "a.vtu", Vtu(tets, v), true);
  v.appended = true;
  add("vtu_appended_base64_zlib", "a.vtu", Vtu(tets, v), true);
  v.raw = true;
  add("vtu_appended_raw_zlib", "a.vtu", Vtu(tets, v), true);
  v.compressed = false;
  add("vtu_appended_raw", "a.vtu", Vtu(tets, v), true);
  v.swapped = true;
  add("vtu_appended_raw_swapped", "a.vtu", Vtu(tets, v), true);
  v.raw = v.long_header = false;
  add("vtu_appended_base64", "a.vtu", Vtu(tets, v), true);
  for (const int first : {0, 1}) {
    add(first == 0 ? "tetgen_ele_0" : "tetgen_ele_1", "a.ele", TetgenElements(tets.tets, first, " 4 1"), true);
    samples.back().beside["a.node"] = TetgenNodes(tets.vertices, first);
  }
  add("tetgen_face", "a.face", TetgenElements(surface.triangles, 1, " 1"), false);
  samples.back().beside["a.node"] = TetgenNodes(surface.vertices, 1);
  add("tetgen_node", "a.node", TetgenNodes(tets.vertices, 0), true);
  samples.back().beside["a.ele"] = TetgenElements(tets.tets, 0, " 4 0");
  add("stl_ascii", "a.stl", Stl(surface, true), false);
  add("stl_binary", "a.stl", Stl(surface, false), false);
  add("obj", "a.obj", Obj(surface), false);
  add("ply_ascii", "a.ply", Ply(surface, Out::kText), false);
  add("ply_binary", "a.ply", Ply(surface, Out::kBinary), false);
  add("ply_binary_swapped", "a.ply", Ply(surface, Out::kSwapped), false);
  return samples;
}

MeshFile ParseSample(const MeshSample& sample, const std::string& bytes) {
  return ParseMesh(bytes, sample.name, [&](const std::filesystem::path& other) -> std::optional<std::string> {
    const auto entry = sample.beside.find(other.string());
    return entry == sample.beside.end() ? std::nullopt : std::optional<std::string>(entry->second);
  });
}

}  // namespace fulcrum::scene
