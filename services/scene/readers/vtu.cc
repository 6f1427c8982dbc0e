#include <bit>
#include <deque>
#include <map>

#include "services/scene/readers/readers.h"
#include "services/scene/readers/vtk_cells.h"
#include "services/scene/readers/vtu_data.h"

namespace fulcrum::scene {
namespace {

/// Four corners per cell on average; only bounds the counts in a file.
constexpr std::uint64_t kMaxConnectivity = 4 * kMaxMeshElements;

struct Tag {
  std::string_view name;
  std::map<std::string_view, std::string_view> attributes;
  std::size_t begin = 0, end = 0;  ///< From '<' to the character after '>'.
  bool closes = false;             ///< </name>
  bool is_empty = false;           ///< <name/>
};

struct Piece {
  std::uint64_t points = 0, cells = 0;
  std::size_t begin = 0;
  VtuArray coordinates, connectivity, offsets, types;
};

class VtuReader {
 public:
  VtuReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  MeshFile Read() {
    Scan();
    for (const Piece& piece : pieces_) {
      AddPiece(piece);
    }
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void Fail(std::size_t at, const std::string& reason) const {
    // A cursor that ends at the fault reports its line.
    Cursor place(bytes_, name_, at);
    (void)place.Word();
    place.Fail(reason);
  }

  static bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

  void SkipBlanks(std::size_t* at) const {
    while (*at < bytes_.size() && IsBlank(bytes_[*at])) {
      ++*at;
    }
  }

  std::string_view TakeName(std::size_t* at) const {
    const std::size_t begin = *at;
    while (*at < bytes_.size() && (std::isalnum(static_cast<unsigned char>(bytes_[*at])) != 0 || bytes_[*at] == '_' ||
                                   bytes_[*at] == ':' || bytes_[*at] == '-' || bytes_[*at] == '.')) {
      ++*at;
    }
    return bytes_.substr(begin, *at - begin);
  }

  /// Reads the next tag from `at_` on; false if there is none. Comments and declarations are skipped.
  bool NextTag(Tag* tag) {
    for (;;) {
      at_ = bytes_.find('<', at_);
      if (at_ == std::string_view::npos) {
        return false;
      }
      const std::string_view rest = bytes_.substr(at_);
      if (!rest.starts_with("<?") && !rest.starts_with("<!")) {
        break;
      }
      const std::string_view end = rest.starts_with("<!--") ? "-->" : ">";
      const std::size_t found = bytes_.find(end, at_);
      if (found == std::string_view::npos) {
        Fail(at_, "a comment without its end: the file was cut short");
      }
      at_ = found + end.size();
    }
    *tag = Tag();
    tag->begin = at_++;
    tag->closes = at_ < bytes_.size() && bytes_[at_] == '/';
    at_ += tag->closes ? 1 : 0;
    tag->name = TakeName(&at_);
    if (tag->name.empty()) {
      Fail(tag->begin, Quote(bytes_.substr(tag->begin, 12)) + " where a tag should be");
    }
    TakeAttributes(tag);
    tag->end = at_;
    return true;
  }

  void TakeAttributes(Tag* tag) {
    for (SkipBlanks(&at_); at_ < bytes_.size() && bytes_[at_] != '>'; SkipBlanks(&at_)) {
      if (bytes_.substr(at_).starts_with("/>")) {
        tag->is_empty = true;
        ++at_;
        continue;
      }
      const std::size_t begin = at_;
      const std::string_view key = TakeName(&at_);
      SkipBlanks(&at_);
      const bool has_value = !key.empty() && at_ < bytes_.size() && bytes_[at_] == '=';
      at_ += has_value ? 1 : 0;
      SkipBlanks(&at_);
      const char quote = has_value && at_ < bytes_.size() ? bytes_[at_] : '\0';
      const std::size_t end = quote == '"' || quote == '\'' ? bytes_.find(quote, at_ + 1) : std::string_view::npos;
      if (end == std::string_view::npos) {
        Fail(begin, Quote(bytes_.substr(begin, 20)) + " where an attribute (name=\"value\") should be");
      }
      tag->attributes[key] = bytes_.substr(at_ + 1, end - at_ - 1);
      at_ = end + 1;
    }
    if (at_ >= bytes_.size()) {
      Fail(tag->begin, "tag " + Quote(tag->name) + " has no end: the file was cut short");
    }
    ++at_;
  }

  static std::string_view Attribute(const Tag& tag, std::string_view key) {
    const auto entry = tag.attributes.find(key);
    return entry == tag.attributes.end() ? std::string_view() : entry->second;
  }

  std::uint64_t Number(const Tag& tag, std::string_view key) const {
    const std::string_view text = Attribute(tag, key);
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) {
      Fail(tag.begin,
           std::string(key) + "=" + Quote(text) + " in " + Quote(tag.name) + "; valid: a number, 0 and above");
    }
    return value;
  }

  void ReadRoot(const Tag& tag) {
    is_poly_ = Attribute(tag, "type") == "PolyData";
    if (!is_poly_ && Attribute(tag, "type") != "UnstructuredGrid") {
      Fail(tag.begin, "type " + Quote(Attribute(tag, "type")) + "; valid: UnstructuredGrid, PolyData");
    }
    const std::string_view order = Attribute(tag, "byte_order");
    if (order != "LittleEndian" && order != "BigEndian" && !order.empty()) {
      Fail(tag.begin, "byte_order " + Quote(order) + "; valid: LittleEndian, BigEndian");
    }
    encoding_.swap = !order.empty() && (order == "LittleEndian") != (std::endian::native == std::endian::little);
    const std::string_view header = Attribute(tag, "header_type");
    if (header != "UInt32" && header != "UInt64" && !header.empty()) {
      Fail(tag.begin, "header_type " + Quote(header) + "; valid: UInt32, UInt64");
    }
    encoding_.long_header = header == "UInt64";
    const std::string_view compressor = Attribute(tag, "compressor");
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
      Fail(tag.begin, "compressor " + Quote(compressor) + "; valid: none, vtkZLibDataCompressor");
    }
    encoding_.compressed = !compressor.empty();
  }

  /// The array of the piece in which this data array is stored; nullptr: not needed.
  VtuArray* Wanted(std::string_view section, std::string_view array) {
    if (pieces_.empty()) {
      return nullptr;
    }
    Piece& piece = pieces_.back();
    if (section == "Points") {
      return &piece.coordinates;
    }
    if (section != (is_poly_ ? "Polys" : "Cells")) {
      return nullptr;
    }
    return array == "connectivity" ? &piece.connectivity
           : array == "offsets"    ? &piece.offsets
           : array == "types"      ? &piece.types
                                   : nullptr;
  }

  void ReadArray(const Tag& tag, std::string_view section) {
    const std::size_t content_end = tag.is_empty ? tag.end : std::min(bytes_.find('<', tag.end), bytes_.size());
    VtuArray* array = Wanted(section, Attribute(tag, "Name"));
    if (array == nullptr) {
      return;
    }
    if (array->present) {
      Fail(tag.begin, "this array of " + Quote(section) + " is there twice");
    }
    array->present = true;
    array->type = Attribute(tag, "type");
    const std::string_view format = Attribute(tag, "format");
    if (format == "appended") {
      array->begin = Number(tag, "offset");  // Counted from the underscore, which comes later in the file.
      array->form = VtuForm::kRaw;
      appended_.push_back({array, tag.begin});
      return;
    }
    if (format != "ascii" && format != "binary") {
      Fail(tag.begin, "format " + Quote(format) + "; valid: ascii, binary, appended");
    }
    array->form = format == "ascii" ? VtuForm::kText : VtuForm::kBase64;
    array->begin = tag.end;
    array->end = content_end;
    const auto components = Attribute(tag, "NumberOfComponents");
    if (section == "Points" && components != "3") {
      Fail(tag.begin, "points of " + Quote(components) + " components; valid: 3");
    }
  }

  void ReadAppended(const Tag& tag) {
    const std::string_view encoding = Attribute(tag, "encoding");
    if (encoding != "raw" && encoding != "base64") {
      Fail(tag.begin, "encoding " + Quote(encoding) + "; valid: raw, base64");
    }
    std::size_t begin = tag.end;
    SkipBlanks(&begin);
    if (begin >= bytes_.size() || bytes_[begin] != '_') {
      Fail(tag.begin, "appended data do not begin with '_'");
    }
    ++begin;
    std::size_t end = bytes_.size();
    if (encoding == "base64") {
      end = std::min(bytes_.find('<', begin), end);
    }
    for (const Appended& a : appended_) {
      VtuArray* array = a.array;
      if (array->begin > end - begin) {
        Fail(a.tag, "offset " + std::to_string(array->begin) + "; valid: at most the " + std::to_string(end - begin) +
                        " bytes of appended data");
      }
      array->form = encoding == "raw" ? VtuForm::kRaw : VtuForm::kBase64;
      array->begin += begin;
      array->end = end;
    }
    appended_.clear();
  }

  void AddPieceOf(const Tag& tag) {
    const auto optional = [&](std::string_view key) { return Attribute(tag, key).empty() ? 0 : Number(tag, key); };
    Piece piece;
    piece.points = Number(tag, "NumberOfPoints");
    piece.cells = Number(tag, is_poly_ ? "NumberOfPolys" : "NumberOfCells");
    piece.begin = tag.begin;
    if (is_poly_) {
      if (const auto strips = optional("NumberOfStrips"); strips != 0) {
        Fail(tag.begin, std::to_string(strips) + " strips of triangles are not read; write triangles or polygons");
      }
      mesh_.skipped += optional("NumberOfVerts") + optional("NumberOfLines");
    }
    pieces_.push_back(piece);
  }

  void Scan() {
    Tag tag;
    bool has_root = false;
    std::string_view section;
    while (NextTag(&tag)) {
      if (tag.closes) {
        ended_ = ended_ || tag.name == "VTKFile";
        section = tag.name == section ? std::string_view() : section;
      } else if (!has_root) {
        if (tag.name != "VTKFile") {
          Fail(tag.begin, "tag " + Quote(tag.name) + "; valid: VTKFile");
        }
        ReadRoot(tag);
        has_root = true;
      } else if (tag.name == "Piece") {
        AddPieceOf(tag);
      } else if (tag.name == "Points" || tag.name == "Cells" || tag.name == "Polys" || tag.name == "Lines" ||
                 tag.name == "Verts" || tag.name == "Strips" || tag.name == "PointData" || tag.name == "CellData") {
        section = tag.is_empty ? std::string_view() : tag.name;
      } else if (tag.name == "DataArray") {
        ReadArray(tag, section);
      } else if (tag.name == "AppendedData") {
        ReadAppended(tag);
        ended_ = true;
        break;
      }
    }
    if (!has_root || !ended_) {
      Fail(bytes_.size(), std::string("the file ends without ") + (has_root ? "'</VTKFile>'" : "'<VTKFile'") +
                              ": it was cut short or is no VTU or VTP");
    }
    if (!appended_.empty()) {
      Fail(appended_[0].tag, "the file has no appended data");
    }
  }

  void AddPiece(const Piece& piece) {
    if (piece.points == 0 && piece.cells == 0) {
      return;  // Writers of files with many parts write empty ones.
    }
    const std::pair<const VtuArray*, const char*> arrays[] = {{&piece.coordinates, "Points"},
                                                              {&piece.connectivity, "connectivity"},
                                                              {&piece.offsets, "offsets"},
                                                              {&piece.types, "types"}};
    for (const auto& [array, what] : arrays) {
      if (!array->present && !(is_poly_ && array == &piece.types)) {
        Fail(piece.begin, "the piece has no array " + Quote(what));
      }
    }
    cells_ += std::min<std::uint64_t>(piece.cells, kMaxMeshElements + 1);
    if (piece.points > kMaxMeshElements - mesh_.vertices.size() || cells_ > kMaxMeshElements) {
      Fail(piece.begin, std::to_string(piece.points) + " points and " + std::to_string(piece.cells) +
                            " cells; valid: at most " + std::to_string(kMaxMeshElements) + " in a file");
    }
    const std::vector<double> x =
        ReadVtuNumbers(bytes_, name_, encoding_, piece.coordinates, "Points", 3 * piece.points);
    const auto first_vertex = static_cast<Index>(mesh_.vertices.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!(std::abs(x[i]) <= kLargestCoordinate)) {
        Fail(piece.begin, "point " + std::to_string(i / 3) + ": coordinate " + std::to_string(x[i]) +
                              " is not finite or beyond 1e6");
      }
      if (i % 3 == 2) {
        mesh_.vertices.emplace_back(x[i - 2], x[i - 1], x[i]);
      }
    }
    VtkCells cells;
    constexpr std::int64_t kPolygon = 7;
    if (!is_poly_) cells.types = ReadVtuIntegers(bytes_, name_, encoding_, piece.types, "types", piece.cells);
    cells.offsets = ReadVtuIntegers(bytes_, name_, encoding_, piece.offsets, "offsets", piece.cells);
    if (is_poly_) cells.types.assign(cells.offsets.size(), kPolygon);
    cells.offsets.insert(cells.offsets.begin(), 0);
    const std::int64_t size = cells.offsets.back();
    if (size < 0 || static_cast<std::uint64_t>(size) > kMaxConnectivity - connectivity_) {
      Fail(piece.begin, "the last offset is " + std::to_string(size) + "; valid: 0 to " +
                            std::to_string(kMaxConnectivity - connectivity_));
    }
    connectivity_ += static_cast<std::uint64_t>(size);
    cells.connectivity =
        ReadVtuIntegers(bytes_, name_, encoding_, piece.connectivity, "connectivity", static_cast<std::uint64_t>(size));
    AddVtkCells(
        cells, first_vertex, piece.points, [&](const std::string& reason) { Fail(piece.begin, reason); }, &mesh_);
  }

  /// An array whose position is known once the appended data are found.
  struct Appended {
    VtuArray* array;
    std::size_t tag;
  };

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  bool ended_ = false;
  bool is_poly_ = false;  ///< Polygonal data (VTP).
  VtuEncoding encoding_;
  std::deque<Piece> pieces_;                    ///< A deque, because pointers to its arrays must stay valid.
  std::uint64_t cells_ = 0, connectivity_ = 0;  ///< Total of all pieces: several may share the same data.
  std::vector<Appended> appended_;
  MeshFile mesh_;
};

}  // namespace

MeshFile ReadVtu(std::string_view bytes, const std::string& name) { return VtuReader(bytes, name).Read(); }

}  // namespace fulcrum::scene
