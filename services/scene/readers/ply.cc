#include <bit>
#include <map>
#include <optional>
#include <vector>

#include "services/scene/readers/readers.h"

namespace fulcrum::scene {
namespace {

constexpr double kLargestIndex = 4294967296.0;  ///< Larger values in a list of floating-point indices are refused.

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct Property {
  std::string name;
  Type type;
  std::optional<Type> count;  ///< Type of the length, for a list.
};

struct Element {
  std::string name;
  std::uint64_t count;
  std::vector<Property> properties;
};

std::size_t SizeOf(Type type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

class PlyReader {
 public:
  PlyReader(std::string_view bytes, const std::string& name) : in_(bytes, name) {}

  MeshFile Read() {
    ReadHeader();
    bool has_vertices = false;
    for (const Element& element : elements_) {
      if (element.name == "vertex") {
        has_vertices = true;
        ReadVertices(element);
      } else if (element.name == "face") {
        if (!has_vertices) {
          in_.Fail("element 'face' stands before element 'vertex'");
        }
        ReadFaces(element);
      } else {
        SkipElement(element);
      }
    }
    return std::move(mesh_);
  }

 private:
  Type ReadType() {
    static const std::map<std::string_view, Type> kTypes = {
        {"char", Type::kInt8},      {"int8", Type::kInt8},       {"uchar", Type::kUint8},
        {"uint8", Type::kUint8},    {"short", Type::kInt16},     {"int16", Type::kInt16},
        {"ushort", Type::kUint16},  {"uint16", Type::kUint16},   {"int", Type::kInt32},
        {"int32", Type::kInt32},    {"uint", Type::kUint32},     {"uint32", Type::kUint32},
        {"float", Type::kFloat32},  {"float32", Type::kFloat32}, {"double", Type::kFloat64},
        {"float64", Type::kFloat64}};
    const std::string_view word = in_.WordOfLine();
    const auto entry = kTypes.find(word);
    if (entry == kTypes.end()) {
      in_.Fail("type " + Quote(word) + "; valid: char, uchar, short, ushort, int, uint, float, double");
    }
    return entry->second;
  }

  void ReadFormat() {
    const std::string_view format = in_.WordOfLine();
    if (format == "binary_little_endian" || format == "binary_big_endian") {
      binary_ = true;
      swap_ = (format == "binary_big_endian") == (std::endian::native == std::endian::little);
    } else if (format != "ascii") {
      in_.Fail("format " + Quote(format) + "; valid: ascii, binary_little_endian, binary_big_endian");
    }
  }

  void ReadProperty() {
    if (elements_.empty()) {
      in_.Fail("a property before any element");
    }
    Property property;
    // A list is "list COUNT_TYPE TYPE NAME"; this cursor only reads ahead.
    Cursor ahead = in_;
    if (ahead.WordOfLine() == "list") {
      in_ = ahead;
      property.count = ReadType();
      if (*property.count == Type::kFloat32 || *property.count == Type::kFloat64) {
        in_.Fail("a list counted in floating point; valid: char, uchar, short, ushort, int, uint");
      }
    }
    property.type = ReadType();
    property.name = in_.WordOfLine();
    elements_.back().properties.push_back(property);
  }

  void ReadHeader() {
    in_.Expect("ply");
    bool has_format = false;
    for (std::string_view word = in_.Word(); word != "end_header"; word = in_.Word()) {
      if (word == "format") {
        ReadFormat();
        has_format = true;
      } else if (word == "element") {
        const std::string element(in_.WordOfLine());
        elements_.push_back({element, in_.Take<std::uint64_t>("a number of elements"), {}});
      } else if (word == "property") {
        ReadProperty();
      } else if (word != "comment" && word != "obj_info") {
        in_.Fail(word.empty() ? "the file ends within its header: it was cut short"
                              : Quote(word) + "; valid: format, element, property, comment, obj_info, end_header");
      }
      in_.Line();
    }
    if (!has_format) {
      in_.Fail("the header has no line 'format'");
    }
    in_.Line();
    if (binary_) {
      in_.SetBinary(swap_);
    }
  }

  /// Refuses an element that needs more bytes than remain.
  void CheckElement(const Element& element) const {
    std::size_t bytes = 0;
    for (const Property& p : element.properties) {
      bytes += SizeOf(p.count.value_or(p.type));
    }
    if (element.count > 0 && element.properties.empty()) {
      in_.Fail("element " + Quote(element.name) + " has no property");
    }
    in_.CheckCount(("elements " + Quote(element.name)).c_str(), element.count, element.properties.size(), bytes);
  }

  double TakeValue(Type type, const char* what) {
    switch (type) {
      case Type::kInt8:
        return TakeSmall<std::int8_t>(what);
      case Type::kUint8:
        return TakeSmall<std::uint8_t>(what);
      case Type::kInt16:
        return in_.Take<std::int16_t>(what);
      case Type::kUint16:
        return in_.Take<std::uint16_t>(what);
      case Type::kInt32:
        return in_.Take<std::int32_t>(what);
      case Type::kUint32:
        return in_.Take<std::uint32_t>(what);
      case Type::kFloat32:
        return in_.Take<float>(what);
      case Type::kFloat64:
        return in_.Take<double>(what);
    }
    in_.Fail("no such type");
  }

  /// Reads a value; in text, one-byte types are numbers too, not characters.
  template <class T>
  double TakeSmall(const char* what) {
    return in_.binary() ? static_cast<double>(in_.Take<T>(what)) : static_cast<double>(in_.Take<int>(what));
  }

  /// Reads the list's values into `values_`.
  void TakeList(const Property& property, const char* what) {
    const double count = TakeValue(*property.count, "the length of a list");
    if (count < 0) {
      in_.Fail("a list of " + std::to_string(count) + " values; valid: 0 and above");
    }
    in_.CheckCount("values of a list", static_cast<std::uint64_t>(count), 1, SizeOf(property.type));
    values_.clear();
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      values_.push_back(TakeValue(property.type, what));
    }
  }

  void SkipProperty(const Property& property) {
    if (property.count) {
      TakeList(property, "a value");
    } else {
      TakeValue(property.type, "a value");
    }
  }

  void SkipElement(const Element& element) {
    CheckElement(element);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& p : element.properties) {
        SkipProperty(p);
      }
    }
  }

  void ReadVertices(const Element& element) {
    CheckElement(element);
    if (!mesh_.vertices.empty()) {
      in_.Fail("element 'vertex' twice");
    }
    constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
    for (const std::string_view axis : kAxes) {
      if (std::none_of(element.properties.begin(), element.properties.end(),
                       [&](const Property& p) { return p.name == axis && !p.count; })) {
        in_.Fail("element 'vertex' has no property " + Quote(axis));
      }
    }
    mesh_.vertices.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Vec3d vertex = Vec3d::Zero();
      for (const Property& p : element.properties) {
        const auto axis = std::find(kAxes.begin(), kAxes.end(), p.name);
        if (axis == kAxes.end() || p.count) {
          SkipProperty(p);
        } else {
          vertex[axis - kAxes.begin()] = in_.CheckCoordinate(TakeValue(p.type, "a coordinate"));
        }
      }
      mesh_.vertices.push_back(vertex);
    }
  }

  void ReadFaces(const Element& element) {
    CheckElement(element);
    const auto holds_corners = [](const Property& p) {
      return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    if (std::none_of(element.properties.begin(), element.properties.end(), holds_corners)) {
      in_.Fail("element 'face' has no list 'vertex_indices' or 'vertex_index'");
    }
    std::vector<Index> corners;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& p : element.properties) {
        if (!holds_corners(p)) {
          SkipProperty(p);
          continue;
        }
        TakeList(p, "a vertex");
        corners.clear();
        for (const double value : values_) {
          if (!(std::abs(value) < kLargestIndex)) {
            in_.Fail("vertex " + std::to_string(value) + " is no index");
          }
          corners.push_back(in_.CheckVertex(static_cast<std::int64_t>(value), 0, mesh_.vertices.size()));
        }
        AddPolygon(corners, in_, &mesh_);
      }
    }
  }

  Cursor in_;
  bool binary_ = false, swap_ = false;
  std::vector<Element> elements_;
  std::vector<double> values_;
  MeshFile mesh_;
};

}  // namespace

MeshFile ReadPly(std::string_view bytes, const std::string& name) { return PlyReader(bytes, name).Read(); }

}  // namespace fulcrum::scene
