// Readers of mesh files: every variant of every format gives the same mesh; altered, truncated or absurd files are
// refused with file, place, value and valid values.
#include "services/scene/readers/readers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "tests/unit/scene/mesh_samples.h"

namespace fulcrum::scene {
namespace {

/// Elements by the positions of their corners: files may order and weld vertices differently.
template <std::size_t N>
std::vector<std::array<Vec3d, N>> Corners(const std::vector<Vec3d>& vertices,
                                          const std::vector<std::array<Index, N>>& elements) {
  std::vector<std::array<Vec3d, N>> corners;
  for (const auto& element : elements) {
    std::array<Vec3d, N>& places = corners.emplace_back();
    for (std::size_t k = 0; k < N; ++k) {
      places[k] = vertices.at(element[k]);
    }
  }
  return corners;
}

const MeshSample& Sample(const std::string& label) {
  static const std::vector<MeshSample> samples = MeshSamples();
  const auto found = std::find_if(samples.begin(), samples.end(), [&](const auto& s) { return s.label == label; });
  EXPECT_NE(found, samples.end()) << label;
  return *found;
}

std::string Refusal(const MeshSample& sample, const std::string& bytes) {
  try {
    (void)ParseSample(sample, bytes);
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

/// `text` with the first `from` replaced, which must exist.
std::string With(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

class EveryVariant : public testing::TestWithParam<MeshSample> {};

TEST(AsciiStl, MayEndInTwoWords) {
  const MeshSample& sample = Sample("stl_ascii");
  EXPECT_EQ(Refusal(sample, With(sample.bytes, "endsolid", "end solid")), "");
}

/// Rounding noise of programs that compute in double is no fault, whatever the type in which a file is read.
TEST(TextOfNumbers, TooSmallForTheirTypeAreZero) {
  const std::string name = "x";
  for (const char* word : {"3.7e-49", "-3.7e-49", "1e-400", "+1E-4000"}) {
    EXPECT_EQ(Cursor(word, name).Take<float>("a number"), 0.0f) << word;
  }
  EXPECT_EQ(Cursor("1e-400", name).Take<double>("a number"), 0.0);
  for (const char* word : {"3.7e49", "1e400", "3.7e-49x", "e-9"}) {
    EXPECT_THROW((void)Cursor(word, name).Take<float>("a number"), InputError) << word;
  }
  EXPECT_THROW((void)Cursor("99999999999", name).Take<std::int32_t>("a number"), InputError);
  const std::string stl =
      "solid x\nfacet normal 0 0 1\nouter loop\nvertex 3.7e-49 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
      "endsolid x\n";
  EXPECT_EQ(ReadStl(stl, "tiny.stl").vertices[0], Vec3d::Zero());
}

TEST_P(EveryVariant, GivesTheMeshThatWasWritten) {
  const MeshFile read = ParseSample(GetParam(), GetParam().bytes);
  if (GetParam().has_tets) {
    EXPECT_EQ(read.vertices, SampleTets().vertices);
    EXPECT_EQ(read.tets, SampleTets().tets);
    EXPECT_TRUE(read.triangles.empty()) << "values on the mesh are left out";
  } else {
    EXPECT_TRUE(read.tets.empty());
    EXPECT_EQ(read.vertices.size(), SampleSurface().vertices.size());
    EXPECT_EQ(Corners(read.vertices, read.triangles), Corners(SampleSurface().vertices, SampleSurface().triangles));
  }
}

TEST_P(EveryVariant, CutShortAnywhereIsRefusedOrStillGivesAllOfIt) {
  const MeshSample& sample = GetParam();
  const MeshFile whole = ParseSample(sample, sample.bytes);
  int refused = 0;
  for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
    const std::string bytes = sample.bytes.substr(0, size);
    try {
      const MeshFile read = ParseSample(sample, bytes);
      // Formats without an end mark: the truncated part is behind the mesh, or consists of digits of its last number.
      EXPECT_LE(read.triangles.size(), whole.triangles.size());
      EXPECT_LE(read.tets.size(), whole.tets.size());
      // OBJ has no count: a truncated file is another valid file.
      const bool is_obj = sample.name == "a.obj";
      const bool within_number = size > 0 && std::isdigit(static_cast<unsigned char>(sample.bytes[size - 1])) != 0 &&
                                 std::isdigit(static_cast<unsigned char>(sample.bytes[size])) != 0;
      if (!is_obj && !within_number) {
        EXPECT_EQ(read.vertices.size(), whole.vertices.size()) << size;
        EXPECT_EQ(read.triangles.size() + read.tets.size(), whole.triangles.size() + whole.tets.size()) << size;
      }
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find("a."), 0u) << error.what();
    }
  }
  EXPECT_GT(refused, static_cast<int>(sample.bytes.size() * 2 / 5));
}

TEST_P(EveryVariant, RefusalsNameTheirPlace) {
  const MeshSample& sample = GetParam();
  const std::string message = Refusal(sample, sample.bytes.substr(0, sample.bytes.size() * 2 / 5));
  EXPECT_TRUE(message.find(": line ") != std::string::npos || message.find(": byte ") != std::string::npos) << message;
}

INSTANTIATE_TEST_SUITE_P(MeshFiles, EveryVariant, testing::ValuesIn(MeshSamples()),
                         [](const auto& test) { return test.param.label; });

TEST(MeshFiles, PointsAndLinesAreCountedAndLeftOut) {
  EXPECT_EQ(ParseSample(Sample("gmsh1"), Sample("gmsh1").bytes).skipped, 2u);
  EXPECT_EQ(ParseSample(Sample("vtk_grid_ascii"), Sample("vtk_grid_ascii").bytes).skipped, 1u);
  EXPECT_EQ(ParseSample(Sample("vtu_base64_zlib"), Sample("vtu_base64_zlib").bytes).skipped, 1u);
}

TEST(MeshFiles, FormatIsKnownByContentWhereTheExtensionIsNot) {
  for (const MeshSample& sample : MeshSamples()) {
    if (sample.beside.empty() && sample.label != "obj" && sample.label != "stl_binary") {
      EXPECT_EQ(ParseMesh(sample.bytes, "mesh.dat").tets.size(), sample.has_tets ? 2u : 0u) << sample.label;
    }
  }
}

TEST(MeshFiles, ExtensionInCapitalsAndCompanionOnDisk) {
  EXPECT_EQ(ParseMesh(Sample("stl_binary").bytes, "A.STL").triangles.size(), 6u);
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "fulcrum_readers_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "a.ele") << Sample("tetgen_ele_1").bytes;
  std::ofstream(folder / "a.node") << Sample("tetgen_ele_1").beside.at("a.node");
  EXPECT_EQ(ReadMesh(folder / "a.ele").tets.size(), 2u);
  EXPECT_EQ(ReadMesh(folder / "a.node").tets.size(), 2u);
  std::filesystem::remove_all(folder);
  EXPECT_THROW((void)ReadMesh("/no/such/file.stl"), InputError);
  EXPECT_THROW((void)ReadMesh("/"), InputError);
}

TEST(MeshFiles, TetrahedraGiveTheirBoundaryWhateverTheirOrientation) {
  const TriangleMesh surface = SurfaceOf(SampleTets());
  EXPECT_EQ(surface.triangles.size(), 6u);
  double volume = 0;
  for (const Triangle& t : surface.triangles) {
    volume += surface.vertices[t[0]].dot(surface.vertices[t[1]].cross(surface.vertices[t[2]])) / 6;
  }
  double tets = 0;
  const MeshFile mesh = SampleTets();
  for (const Tetrahedron& t : mesh.tets) {
    tets += std::abs(SignedVolume(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]));
  }
  EXPECT_NEAR(volume, tets, 1e-12);
}

TEST(MeshFiles, PolygonsStripsAndPixelsBecomeTriangles) {
  const std::string head = "# vtk DataFile Version 2.0\nx\nASCII\nDATASET ";
  const std::string points = "POINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0\n";
  const auto area = [](const MeshFile& m) {
    double sum = 0;
    for (const Triangle& t : m.triangles) {
      sum += (m.vertices[t[1]] - m.vertices[t[0]]).cross(m.vertices[t[2]] - m.vertices[t[0]]).z() / 2;
    }
    return sum;
  };
  EXPECT_DOUBLE_EQ(area(ParseMesh(head + "POLYDATA\n" + points + "TRIANGLE_STRIPS 1 5\n4 0 1 2 3\n", "a.vtk")), 1);
  EXPECT_DOUBLE_EQ(area(ParseMesh(head + "POLYDATA\n" + points + "POLYGONS 1 5\n4 0 1 3 2\n", "a.vtk")), 1);
  const std::string grid = head + "UNSTRUCTURED_GRID\n" + points;
  EXPECT_DOUBLE_EQ(area(ParseMesh(grid + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n8\n", "a.vtk")), 1) << "a pixel";
  EXPECT_DOUBLE_EQ(area(ParseMesh(grid + "CELLS 1 5\n4 0 1 3 2\nCELL_TYPES 1\n9\n", "a.vtk")), 1) << "a quad";
  EXPECT_DOUBLE_EQ(area(ParseMesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2//1 4/1 3/1/1\n", "a.obj")), 1);
}

// ---------------------------------------------------------------------------------------------------- refusals

struct Fault {
  const char* sample;
  const char* from;
  const char* to;
  std::vector<const char*> says;
};

void PrintTo(const Fault& fault, std::ostream* out) {
  *out << fault.sample << ": " << fault.from << " -> " << fault.to;
}

class FaultyFile : public testing::TestWithParam<Fault> {};

TEST_P(FaultyFile, IsRefusedWithFilePlaceAndReason) {
  const MeshSample& sample = Sample(GetParam().sample);
  const std::string message = Refusal(sample, With(sample.bytes, GetParam().from, GetParam().to));
  EXPECT_EQ(message.find(sample.name + ": "), 0u) << message;
  for (const char* part : GetParam().says) {
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
  }
}

const Fault kFaults[] = {
    {"gmsh1", "$NOD\n5", "$NOD\n4000000000", {"line 2", "4000000000 nodes", "at most 10000000"}},
    {"gmsh1", "$NOD\n5", "$NOD\n500000", {"line 2", "500000 nodes", "hold at most"}},
    {"gmsh1", "$NOD\n5", "$NOD\n-5", {"line 2", "'-5' where the number of nodes should be"}},
    {"gmsh1", "9 4 1 1 4", "9 4 1 1 5", {"5 nodes in an element of kind 4; valid: 4"}},
    {"gmsh1", "9 4 1 1 4", "9 11 1 1 10", {"line 13", "kind 11", "valid: 1 and 8 (lines)"}},
    {"gmsh1", "2 7 10", "2 7 99", {"node 99 is none of the 5 nodes"}},
    {"gmsh1", "$ENDNOD", "$ENDNOT", {"'$ENDNOT' where '$ENDNOD' should be"}},
    {"gmsh22_ascii", "2.2 0 8", "3.0 0 8", {"line 2", "version '3.0'; valid"}},
    {"gmsh22_ascii", "2.2 0 8", "2.2 7 8", {"file type 7; valid: 0 (ASCII) and 1 (binary)"}},
    {"gmsh22_ascii", "2.2 0 8", "2.2 0 4", {"numbers of 4 bytes; valid: 8"}},
    {"gmsh22_ascii", "$MeshFormat", "$MashFormat", {"no '$EndMashFormat' follows"}},
    {"gmsh22_ascii", "1.5 ", "x1.5 ", {"'x1.5' where a coordinate should be"}},
    {"gmsh22_ascii", "1.5 ", "nan ", {"coordinate nan is not finite"}},
    {"gmsh22_ascii", "1.5 ", "1e7 ", {"beyond 1e6"}},
    {"gmsh22_ascii", "10 1.5", "7 1.5", {"node 7 twice"}},
    {"gmsh22_ascii", "$Elements\n3", "$Elements\n4", {"'$EndElements' where the number of an element"}},
    {"gmsh22_ascii", "1 1 2 1 1", "1 1 -2 1 1", {"-2 tags"}},
    {"gmsh22_ascii", "1 1 2 1 1", "1 1 2000000 1 1", {"2000000 tags"}},
    {"gmsh41_ascii", "2 5 7 19", "9 5 7 19", {"'$EndNodes' where the dimension of an entity should be"}},
    {"gmsh41_ascii", "2 5 7 19", "2 4 7 19", {"a block of 3; valid: at most the 2"}},
    {"gmsh41_ascii", "2 5 7 19", "2 6 7 19", {"contain 1 fewer"}},
    {"gmsh41_ascii", "3 1 4 2", "3 1 5 2", {"kind 5", "Split hexahedra"}},
    {"gmsh41_ascii", "1 1 1 2", "7 1 1 2", {"dimension 7; valid: 0 to 3"}},
    {"vtk_grid_ascii", "3.0", "9.0", {"line 1", "valid: '# vtk DataFile Version 1.0' to 5.x"}},
    {"vtk_grid_ascii", "ASCII", "EBCDIC", {"line 3", "'EBCDIC'; valid: ASCII, BINARY"}},
    {"vtk_grid_ascii", "UNSTRUCTURED_GRID", "STRUCTURED_GRID", {"line 4", "valid: POLYDATA, UNSTRUCTURED_GRID"}},
    {"vtk_grid_ascii", "POINTS 5", "POINTS 5000000000", {"5000000000 points"}},
    {"vtk_grid_ascii", "POINTS 5 double", "POINTS 5 bit", {"'bit'; valid: float, double"}},
    {"vtk_grid_ascii", "4 0 1 2 3", "4 0 1 2 5", {"vertex 5; valid: 0 to 4"}},
    {"vtk_grid_ascii", "4 0 1 2 3", "-4 0 1 2 3", {"-4 corners in cell 1"}},
    {"vtk_grid_ascii", "CELLS 3 13", "CELLS 3 14", {"fill 13 of 14 entries"}},
    {"vtk_grid_ascii", "CELLS 3 13", "CELLS 3 12", {"4 corners in cell 2; valid: 0 to the 3"}},
    {"vtk_grid_ascii", "CELLS 3 13", "CELLS 99999999 99999999", {"99999999 entries of cells; valid: at most"}},
    {"vtk_grid_ascii", "CELL_TYPES 3\n3", "CELL_TYPES 3\n12", {"cell 0: type 12", "Split other cells"}},
    {"vtk_grid_ascii", "CELL_TYPES 3\n3", "CELL_TYPES 3\n10", {"cell 0: type 10 with 2 corners; valid: 4"}},
    {"vtk_grid_ascii", "CELL_TYPES 3", "CELL_TYPES 2", {"'10'; valid: POINTS, CELLS"}},
    {"vtk_grid_ascii", "CELL_TYPES", "CELL_TYPOS", {"'CELL_TYPOS'; valid:"}},
    {"vtk_grid_ascii", "TIME 1 1 double", "TIME 1 1 bit", {"a field of type 'bit'"}},
    {"vtk_grid_binary", "POINTS 5", "POINTS 500", {": byte ", "500 points"}},
    {"vtk5_grid_ascii", "OFFSETS vtktypeint64", "OFFSETS string", {"OFFSETS of type 'string'"}},
    {"vtk5_grid_ascii", "0 4 8", "0 9 8", {"cell 0: entries 0 to 9"}},
    {"vtk5_grid_ascii", "0 4 8", "0 4 3", {"cell 1: entries 4 to 3; valid: ascending"}},
    {"vtp", "NumberOfStrips=\"0\"", "NumberOfStrips=\"2\"", {"2 strips of triangles are not read"}},
    {"vtp", "NumberOfPolys=\"", "NumberOfPolys=\"-", {"valid: a number, 0 and above"}},
    {"off", "OFF  #", "OFX  #", {"where OFF, COFF or NOFF should be"}},
    {"off", "\n3 ", "\n2 ", {"a face of 2 corners; valid: at least 3"}},
    {"vtu_ascii",
     "type=\"UnstructuredGrid\"",
     "type=\"ImageData\"",
     {"line 3", "'ImageData'; valid: UnstructuredGrid, PolyData"}},
    {"vtu_ascii", "LittleEndian", "MiddleEndian", {"byte_order 'MiddleEndian'"}},
    {"vtu_ascii", "UInt32", "UInt16", {"header_type 'UInt16'; valid: UInt32, UInt64"}},
    {"vtu_base64_zlib",
     "vtkZLibDataCompressor",
     "vtkLZ4DataCompressor",
     {"'vtkLZ4DataCompressor'; valid: none, vtkZLib"}},
    {"vtu_base64_zlib", "NumberOfPoints=\"5\"", "NumberOfPoints=\"6\"", {"for Points; valid: 144 bytes in all"}},
    {"vtu_base64_zlib", "NumberOfPoints=\"5\"", "NumberOfPoints=\"9999999\"", {"valid: 239999976 bytes in all"}},
    {"vtu_base64", "NumberOfPoints=\"5\"", "NumberOfPoints=\"4\"", {"120 bytes of Points; valid: 96"}},
    {"vtu_base64", "NumberOfPoints=\"5\"", "NumberOfPoints=\"x\"", {"NumberOfPoints='x' in 'Piece'; valid: a number"}},
    {"vtu_ascii", "NumberOfPoints=\"5\"", "NumberOfPoints=\"500\"", {"1500 Points, but the"}},
    {"vtu_ascii", "NumberOfPoints=\"5\"", "NumberOfPoints=\"4\"", {"more than the 12 values of Points"}},
    {"vtu_ascii", "0 1 0 1 2 3", "0 1 0 1 2 8", {"cell 1: vertex 8; valid: 0 to below 5"}},
    {"vtu_ascii", "0 1 0 1 2 3", "0 1 0 1 2 .", {"'.' where connectivity should be"}},
    {"vtu_ascii", "3 10 10", "3 24 10", {"cell 1: type 24", "first order"}},
    {"vtu_ascii", "2 6 10", "2 6 90", {"90 connectivity, but the"}},
    {"vtu_ascii", "Name=\"offsets\"", "Name=\"onsets\"", {"the piece has no array 'offsets'"}},
    {"vtu_ascii", "type='Float64'", "type='Int32'", {"Points of type 'Int32'; valid: Float32, Float64"}},
    {"vtu_ascii", "NumberOfComponents=\"3\"", "NumberOfComponents=\"2\"", {"points of '2' components; valid: 3"}},
    {"vtu_ascii", "</VTKFile>", "", {"the file ends without '</VTKFile>'"}},
    {"vtu_ascii", "<VTKFile", "<XTKFile", {"tag 'XTKFile'; valid: VTKFile"}},
    {"vtu_ascii", "version=\"1.0\" byte", "version=1.0 byte", {"where an attribute (name=\"value\") should be"}},
    {"vtu_appended_raw", "encoding=\"raw\"", "encoding=\"hex\"", {"encoding 'hex'; valid: raw, base64"}},
    {"vtu_appended_raw", ">\n_", ">\n", {"do not begin with '_'"}},
    {"vtu_appended_raw", "<AppendedData", "</AppendedData", {"the file has no appended data"}},
    {"vtu_appended_raw", "offset=\"12\"", "offset=\"999999\"", {"offset 999999; valid: at most the"}},
    {"tetgen_ele_1", "2 4 1", "2 10 1", {"line 1", "10 nodes a tetrahedron; valid: 4"}},
    {"tetgen_ele_1", "2 4 1", "200 4 1", {"200 tetrahedra, but the"}},
    {"tetgen_ele_1", "1 1 2 3 4", "1 1 2 3 6", {"line 2", "vertex 6; valid: 1 to 5"}},
    {"tetgen_ele_0", "0 0 1 2 3", "0 0 1 2 5", {"vertex 5; valid: 0 to 4"}},
    {"tetgen_ele_0", "0 0 1 2 3", "0 0 1 2", {"line 2", "vertex -1; valid: 0 to 4"}},
    {"tetgen_node", "5  3", "5  2", {"line 2", "dimension 2; valid: 3"}},
    {"tetgen_node", "\n0 0 0 0", "\n3 0 0 0", {"first vertex has number 3; valid: 0 or 1"}},
    {"tetgen_node", "\n2 0 2.25", "\n4 0 2.25", {"line 5", "vertex number 4; valid here: 2"}},
    {"stl_ascii", "endloop", "banana", {"line 7", "unknown word 'banana'"}},
    {"stl_ascii", "  vertex 0 0 0", "", {"2 corners in a facet; valid: 3"}},
    {"stl_ascii", " endloop\nendfacet", "vertex 0 0 0\nendfacet", {"more than three corners"}},
    {"stl_ascii", "endsolid thing\n", "", {"no 'endsolid' at the end"}},
    {"obj", "v 0 0 0", "v 0 x 0", {"line 3", "'x' where a coordinate should be"}},
    {"obj", "f 1//1 2//1 4//1", "f 1//1 2//1 6//1", {"line 10", "vertex 6; valid: 1 to 5"}},
    {"obj", "f 1//1 2//1 4//1", "f 1 2", {"a face of 2 corners; valid: at least 3"}},
    {"obj", "f 1//1 2//1 4//1", "f 1 2 -9", {"vertex -9"}},
    {"obj", "f 1//1 2//1 4//1", "f 1 2 0", {"vertex 0; valid: 1 to 5"}},
    {"ply_ascii", "format ascii", "format utf8", {"line 2", "format 'utf8'; valid: ascii"}},
    {"ply_ascii", "format ascii 1.0\n", "", {"no line 'format'"}},
    {"ply_ascii", "property float x", "property float w", {"no property 'x'"}},
    {"ply_ascii", "property float x", "property half x", {"line 5", "type 'half'; valid: char"}},
    {"ply_ascii", "list uchar short", "list float short", {"a list counted in floating point"}},
    {"ply_ascii", "vertex_indices", "corners", {"no list 'vertex_indices'"}},
    {"ply_ascii", "element vertex 5", "element vertex 5000", {"5000 elements 'vertex'"}},
    {"ply_ascii", "3 0 1 3", "3 0 1 5", {"vertex 5; valid: 0 to 4"}},
    {"ply_ascii", "3 0 1 3", "-3 0 1 3", {"a list of -3"}},
    {"ply_ascii", "3 0 1 3", "2 0 1 3", {"a face of 2 corners"}},
    {"ply_ascii", "end_header", "end_heap", {"'end_heap'; valid: format"}},
    {"ply_binary", "element vertex 5", "element vertex 4000000", {": byte ", "4000000 elements 'vertex'"}},
};

INSTANTIATE_TEST_SUITE_P(MeshFiles, FaultyFile, testing::ValuesIn(kFaults), [](const auto& test) {
  return std::string(test.param.sample) + "_" + std::to_string(test.index);
});

TEST(MeshFiles, FaultsInBinaryDataNameTheByte) {
  const auto expect = [](const char* label, const std::string& bytes, const char* says) {
    const std::string message = Refusal(Sample(label), bytes);
    EXPECT_NE(message.find(says), std::string::npos) << message;
  };
  std::string stl = Sample("stl_binary").bytes;
  expect("stl_binary", stl.substr(0, 60), "a.stl: line 1");
  expect("stl_binary", With(stl, "solid", "xolid").substr(0, stl.size() - 1), "a.stl: byte 80: its count is 6");
  std::memset(stl.data() + 84 + 12, 0xff, 4);
  expect("stl_binary", stl, "a.stl: byte 96: coordinate");
  stl = With(Sample("stl_binary").bytes, "solid", "xolid");
  std::memset(stl.data() + 80, 0xff, 4);
  expect("stl_binary", stl, "4294967295 triangles");
  std::string msh = Sample("gmsh22_binary").bytes;
  const std::size_t elements = msh.find("$Elements\n3\n") + 12;
  msh[elements + 4] = 100;  // The first block's size.
  expect("gmsh22_binary", msh, "a block of 100 elements; valid: 1 to 3");
  msh = Sample("gmsh22_binary").bytes;
  msh[msh.find("2.2 1 8\n") + 8] = 3;
  expect("gmsh22_binary", msh, "3 where the number 1 should show the byte order");
  std::string vtu = Sample("vtu_appended_raw_zlib").bytes;
  const std::size_t stream = vtu.find("\x78\x9c", vtu.find("encoding=\"raw\"") + 100);
  ASSERT_NE(stream, std::string::npos);
  vtu[stream + 4] = static_cast<char>(vtu[stream + 4] ^ 0x55);
  expect("vtu_appended_raw_zlib", vtu, "a compressed block of ");
}

TEST(MeshFiles, CompanionsThatAreMissingAreNamed) {
  MeshSample sample = Sample("tetgen_ele_0");
  sample.beside.clear();
  EXPECT_EQ(Refusal(sample, sample.bytes), "a.ele: needs a.node beside it, which is not there");
  sample = Sample("tetgen_node");
  sample.beside.clear();
  EXPECT_EQ(Refusal(sample, sample.bytes), "a.node: needs a.ele or a.face beside it; neither is there");
  sample.beside["a.ele"] = "2 4 0\n0 0 1 2 9\n1 0 1 2 3\n";
  EXPECT_EQ(Refusal(sample, sample.bytes).find("a.ele: line 2: vertex 9"), 0u) << "the message names the faulty file";
}

TEST(MeshFiles, NothingAndTheUnknownAreRefused) {
  const auto refusal = [](const std::string& bytes, const char* name) {
    return Refusal({"", name, "", {}, false}, bytes);
  };
  EXPECT_NE(refusal("", "a.dat").find("unknown mesh format '.dat'; valid: .msh, .vtk"), std::string::npos);
  EXPECT_NE(refusal("", "a.obj").find("holds neither a triangle nor a tetrahedron"), std::string::npos);
  EXPECT_NE(refusal("solid x\nendsolid x\n", "a.stl").find("holds neither"), std::string::npos);
  for (const char* name : {"a.msh", "a.vtk", "a.vtu", "a.ply", "a.stl"}) {
    EXPECT_EQ(refusal("", name).find(name), 0u);
  }
}

}  // namespace
}  // namespace fulcrum::scene
