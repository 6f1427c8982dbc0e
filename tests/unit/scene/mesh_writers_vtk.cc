#include <zlib.h>

#include "tests/unit/scene/mesh_writers.h"

namespace fulcrum::scene::writers {
namespace {

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

/// Appended: two blocks, the second one shorter. Inline: one block, announced with the usual size, which exceeds the
/// data. Header and data are padded separately, as in VTK's own writer.
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

}  // namespace

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

}  // namespace fulcrum::scene::writers
