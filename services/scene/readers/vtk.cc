#include <bit>
#include <map>

#include "services/scene/readers/readers.h"
#include "services/scene/readers/vtk_cells.h"

namespace fulcrum::scene {
namespace {

/// Bytes of a value in binary data, by VTK's type name; 0 if values are not whole bytes or have no fixed size.
std::size_t SizeOf(std::string_view type) {
  static const std::map<std::string_view, std::size_t> kSizes = {
      {"char", 1},         {"unsigned_char", 1}, {"signed_char", 1}, {"short", 2},         {"unsigned_short", 2},
      {"int", 4},          {"unsigned_int", 4},  {"float", 4},       {"double", 8},        {"vtktypeint32", 4},
      {"vtktypeint64", 8}, {"vtkIdType", 8},     {"long", 8},        {"unsigned_long", 8}, {"vtktypeuint64", 8}};
  const auto entry = kSizes.find(type);
  return entry == kSizes.end() ? 0 : entry->second;
}

class VtkReader {
 public:
  VtkReader(std::string_view bytes, const std::string& name) : in_(bytes, name) {}

  MeshFile Read() {
    ReadHeader();
    for (std::string_view word = in_.Word(); !word.empty(); word = in_.Word()) {
      if (word == "POINTS") {
        ReadPoints();
      } else if (word == "CELLS" && grid_) {
        cells_ = ReadCells();
      } else if (word == "CELL_TYPES" && grid_) {
        ReadTypes();
      } else if (word == "POLYGONS" || word == "TRIANGLE_STRIPS" || word == "LINES" || word == "VERTICES") {
        constexpr std::int64_t kPolygon = 7, kStrip = 6, kPolyLine = 4;
        AddCells(word == "POLYGONS" ? kPolygon : word == "TRIANGLE_STRIPS" ? kStrip : kPolyLine);
      } else if (word == "METADATA") {
        SkipMetadata();
      } else if (word == "FIELD") {
        SkipField();
      } else if (word == "CELL_DATA" || word == "POINT_DATA") {
        break;  // Values on the mesh follow: not needed.
      } else {
        in_.Fail(Quote(word) + (grid_ ? "; valid: POINTS, CELLS, CELL_TYPES, FIELD, METADATA, CELL_DATA, POINT_DATA"
                                      : "; valid: POINTS, POLYGONS, TRIANGLE_STRIPS, LINES, VERTICES, FIELD, METADATA, "
                                        "CELL_DATA, POINT_DATA"));
      }
    }
    if (grid_) {
      if (cells_.offsets.empty() || !has_types_) {
        in_.Fail("the file ends without CELLS and CELL_TYPES: it was cut short");
      }
      Append(cells_);
    }
    return std::move(mesh_);
  }

 private:
  void ReadHeader() {
    constexpr std::string_view kMark = "# vtk DataFile Version ";
    const std::string_view first = in_.Line();
    const std::string_view version = first.substr(std::min(first.size(), kMark.size()));
    if (!first.starts_with(kMark) || version.size() < 3 || version[0] < '1' || version[0] > '5' || version[1] != '.') {
      in_.Fail(Quote(first) + "; valid: '# vtk DataFile Version 1.0' to 5.x");
    }
    has_offsets_ = version[0] == '5';
    in_.Line();  // Title.
    const std::string_view form = in_.Word();
    if (form != "ASCII" && form != "BINARY") {
      in_.Fail(Quote(form) + "; valid: ASCII, BINARY");
    }
    binary_ = form == "BINARY";
    in_.Expect("DATASET");
    const std::string_view set = in_.Word();
    if (set != "POLYDATA" && set != "UNSTRUCTURED_GRID") {
      in_.Fail("data set " + Quote(set) + "; valid: POLYDATA, UNSTRUCTURED_GRID");
    }
    grid_ = set == "UNSTRUCTURED_GRID";
  }

  /// Skips to the next line, on which numbers begin; binary ones have the most significant byte first.
  void BeginData() {
    if (binary_) {
      in_.Line();
      in_.SetBinary(std::endian::native == std::endian::little);
    }
  }
  void EndData() { in_.SetText(); }

  void ReadPoints() {
    if (!mesh_.vertices.empty()) {
      in_.Fail("POINTS twice");
    }
    const auto count = in_.Take<std::uint64_t>("the number of points");
    const std::string_view type = in_.Word();
    const bool is_double = type == "double";
    if (!is_double && type != "float") {
      in_.Fail("points of type " + Quote(type) + "; valid: float, double");
    }
    BeginData();
    in_.CheckCount("points", count, 3, 3 * (is_double ? sizeof(double) : sizeof(float)));
    mesh_.vertices.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      Vec3d p;
      for (int k = 0; k < 3; ++k) {
        p[k] = is_double ? in_.TakeCoordinate<double>() : in_.TakeCoordinate<float>();
      }
      mesh_.vertices.push_back(p);
    }
    EndData();
  }

  std::int64_t TakeVertex(std::int64_t value) {
    return static_cast<std::int64_t>(in_.CheckVertex(value, 0, mesh_.vertices.size()));
  }

  VtkCells ReadCells() {
    const auto first = in_.Take<std::uint64_t>("the number of cells");
    const auto size = in_.Take<std::uint64_t>("the size of the list of cells");
    return has_offsets_ ? ReadCells5(first, size) : ReadCells1(first, size);
  }

  /// Up to version 4: each cell is the number of its corners, then the corners.
  VtkCells ReadCells1(std::uint64_t count, std::uint64_t size) {
    BeginData();
    in_.CheckCount("entries of cells", size, 1, sizeof(std::int32_t));
    if (count > size) {
      in_.Fail(std::to_string(count) + " cells in a list of " + std::to_string(size));
    }
    VtkCells cells;
    cells.offsets.push_back(0);
    std::uint64_t left = size;
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto corners = in_.Take<std::int32_t>("a number of corners");
      if (corners < 0 || left == 0 || static_cast<std::uint64_t>(corners) > left - 1) {
        in_.Fail(std::to_string(corners) + " corners in cell " + std::to_string(i) + "; valid: 0 to the " +
                 std::to_string(left > 0 ? left - 1 : 0) + " entries left of the " + std::to_string(size) +
                 " announced");
      }
      for (std::int32_t k = 0; k < corners; ++k) {
        cells.connectivity.push_back(TakeVertex(in_.Take<std::int32_t>("a vertex")));
      }
      left -= static_cast<std::uint64_t>(corners) + 1;
      cells.offsets.push_back(static_cast<std::int64_t>(cells.connectivity.size()));
    }
    if (left != 0) {
      in_.Fail("the cells fill " + std::to_string(size - left) + " of " + std::to_string(size) + " entries announced");
    }
    EndData();
    return cells;
  }

  /// From version 5 on: offsets, then corners.
  VtkCells ReadCells5(std::uint64_t offsets, std::uint64_t size) {
    VtkCells cells;
    cells.offsets = ReadIntegers("OFFSETS", offsets, false);
    cells.connectivity = ReadIntegers("CONNECTIVITY", size, true);
    if (cells.offsets.empty()) {
      cells.offsets.push_back(0);
    }
    return cells;
  }

  std::vector<std::int64_t> ReadIntegers(const char* keyword, std::uint64_t count, bool vertices) {
    in_.Expect(keyword);
    const std::string_view type = in_.Word();
    const bool is_long = type == "vtktypeint64" || type == "vtkIdType" || type == "long";
    if (!is_long && type != "vtktypeint32" && type != "int") {
      in_.Fail(std::string(keyword) + " of type " + Quote(type) + "; valid: vtktypeint64, vtktypeint32");
    }
    BeginData();
    in_.CheckCount(keyword, count, 1, is_long ? sizeof(std::int64_t) : sizeof(std::int32_t));
    std::vector<std::int64_t> values;
    values.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::int64_t value = is_long ? in_.Take<std::int64_t>("an index") : in_.Take<std::int32_t>("an index");
      values.push_back(vertices ? TakeVertex(value) : value);
    }
    EndData();
    return values;
  }

  void ReadTypes() {
    const auto count = in_.Take<std::uint64_t>("the number of types");
    BeginData();
    in_.CheckCount("types of cells", count, 1, sizeof(std::int32_t));
    cells_.types.clear();
    cells_.types.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      cells_.types.push_back(in_.Take<std::int32_t>("the type of a cell"));
    }
    EndData();
    has_types_ = true;
  }

  void AddCells(std::int64_t type) {
    VtkCells cells = ReadCells();
    cells.types.assign(cells.offsets.size() - 1, type);
    Append(cells);
  }

  void Append(const VtkCells& cells) {
    AddVtkCells(
        cells, 0, mesh_.vertices.size(), [this](const std::string& reason) { in_.Fail(reason); }, &mesh_);
  }

  /// Ends with an empty line.
  void SkipMetadata() {
    in_.Line();
    while (in_.left() > 0 && !in_.Line().empty()) {
    }
  }

  void SkipField() {
    (void)in_.Word();  // Its name.
    const std::size_t arrays = in_.TakeCount<std::uint64_t>("arrays of a field", 4, 4);
    for (std::size_t i = 0; i < arrays; ++i) {
      (void)in_.Word();
      const std::size_t components = in_.TakeCount<std::uint64_t>("components", 1, 1);
      const std::size_t tuples = in_.TakeCount<std::uint64_t>("tuples", 1, 1);
      const std::string_view type = in_.Word();
      const std::size_t size = SizeOf(type);
      if (size == 0) {
        in_.Fail("a field of type " + Quote(type) + "; valid: numbers of whole bytes");
      }
      BeginData();
      in_.CheckCount("values of a field", components * tuples, 1, size);
      if (binary_) {
        in_.Skip(components * tuples * size, "a field");
      }
      for (std::size_t k = 0; !binary_ && k < components * tuples; ++k) {
        (void)in_.Take<double>("a value of a field");
      }
      EndData();
    }
  }

  Cursor in_;
  bool binary_ = false, grid_ = false, has_offsets_ = false, has_types_ = false;
  VtkCells cells_;
  MeshFile mesh_;
};

}  // namespace

MeshFile ReadVtk(std::string_view bytes, const std::string& name) { return VtkReader(bytes, name).Read(); }

}  // namespace fulcrum::scene
