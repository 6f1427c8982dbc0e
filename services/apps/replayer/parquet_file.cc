#include "services/apps/replayer/parquet_file.h"

#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <string_view>

namespace fulcrum::replay {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::string_view kMagic = "PAR1";
// Numbers of the format's parquet.thrift.
constexpr int kBoolean = 0, kInt64 = 2, kFloat = 4;  // Type, in the order of the variant below.
constexpr int kRequired = 0, kRepeated = 2;          // FieldRepetitionType.
constexpr int kList = 3;                             // ConvertedType.
constexpr int kPlain = 0, kRle = 3;                  // Encoding.
constexpr int kUncompressed = 0, kDataPage = 0;      // CompressionCodec, PageType.

int TypeOf(const ParquetColumn& column) {
  constexpr int kTypes[] = {kFloat, kInt64, kBoolean};
  return kTypes[column.values.index()];
}

std::size_t ValuesOf(const ParquetColumn& column) {
  return std::visit([](const auto& values) { return values.size(); }, column.values);
}

void AppendVarint(std::uint64_t value, Bytes* to) {
  for (; value >= 0x80; value >>= 7) to->push_back(static_cast<std::uint8_t>(value | 0x80));
  to->push_back(static_cast<std::uint8_t>(value));
}

/// A struct in Thrift's compact protocol. Fields must be added in the order of their numbers.
class Struct {
 public:
  void Integer(int field, std::int64_t value, bool is_64 = false) {
    Begin(field, is_64 ? 6 : 5);
    AppendInteger(value, &bytes_);
  }
  void Text(int field, std::string_view text) {
    Begin(field, 8);
    AppendText(text, &bytes_);
  }
  void Add(int field, const Struct& value) {
    Begin(field, 12);
    Append(value);
  }
  void Integers(int field, std::initializer_list<int> values) {
    BeginList(field, 5, values.size());
    for (const int value : values) AppendInteger(value, &bytes_);
  }
  void Texts(int field, std::span<const std::string> texts) {
    BeginList(field, 8, texts.size());
    for (const std::string& text : texts) AppendText(text, &bytes_);
  }
  void Structs(int field, std::span<const Struct> values) {
    BeginList(field, 12, values.size());
    for (const Struct& value : values) Append(value);
  }
  /// With the byte that ends it.
  [[nodiscard]] Bytes Whole() const {
    Bytes whole = bytes_;
    whole.push_back(0);
    return whole;
  }

 private:
  static void AppendInteger(std::int64_t value, Bytes* to) {
    AppendVarint((static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63), to);
  }
  static void AppendText(std::string_view text, Bytes* to) {
    AppendVarint(text.size(), to);
    to->insert(to->end(), text.begin(), text.end());
  }
  void Append(const Struct& value) {
    const Bytes whole = value.Whole();
    bytes_.insert(bytes_.end(), whole.begin(), whole.end());
  }
  void Begin(int field, int type) {
    bytes_.push_back(static_cast<std::uint8_t>((field - last_) << 4 | type));
    last_ = field;
  }
  void BeginList(int field, int type, std::size_t size) {
    Begin(field, 9);
    if (size < 15) {
      bytes_.push_back(static_cast<std::uint8_t>(size << 4 | static_cast<std::size_t>(type)));
    } else {
      bytes_.push_back(static_cast<std::uint8_t>(0xF0 | type));
      AppendVarint(size, &bytes_);
    }
  }

  Bytes bytes_;
  int last_ = 0;
};

void AppendFixed(const void* data, std::size_t size, Bytes* to) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);  // The format is little endian, as our CPUs are.
  to->insert(to->end(), bytes, bytes + size);
}

/// A run of one level of one bit.
void AppendRun(std::size_t count, std::uint8_t level, Bytes* to) {
  if (count == 0) return;
  AppendVarint(count << 1, to);
  to->push_back(level);
}

void AppendLevels(const Bytes& runs, Bytes* to) {
  const auto size = static_cast<std::uint32_t>(runs.size());
  AppendFixed(&size, sizeof(size), to);
  to->insert(to->end(), runs.begin(), runs.end());
}

struct AppendValues {
  Bytes* to;
  template <class T>
  void operator()(const std::vector<T>& values) const {
    AppendFixed(values.data(), sizeof(T) * values.size(), to);
  }
  void operator()(const std::vector<bool>& values) const {
    const std::size_t begin = to->size();
    to->resize(begin + (values.size() + 7) / 8);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i]) (*to)[begin + i / 8] |= static_cast<std::uint8_t>(1u << (i % 8));
    }
  }
};

/// Of a list the levels come first: a new list begins where the repetition level is 0; each value is defined.
Bytes PageOf(const ParquetColumn& column) {
  Bytes page;
  if (column.length > 0) {
    Bytes repetition, definition;
    for (std::size_t i = 0; i < ValuesOf(column); i += column.length) {
      AppendRun(1, 0, &repetition);
      AppendRun(column.length - 1, 1, &repetition);
    }
    AppendRun(ValuesOf(column), 1, &definition);
    AppendLevels(repetition, &page);
    AppendLevels(definition, &page);
  }
  std::visit(AppendValues{&page}, column.values);
  return page;
}

Struct Leaf(int type, std::string_view name) {
  Struct element;
  element.Integer(1, type);
  element.Integer(3, kRequired);
  element.Text(4, name);
  return element;
}

/// The root, then the columns; a list is a group of a repeated group of the element.
std::vector<Struct> SchemaOf(std::span<const ParquetColumn> columns) {
  std::vector<Struct> schema(1);
  schema.front().Text(4, "schema");
  schema.front().Integer(5, static_cast<std::int64_t>(columns.size()));
  for (const ParquetColumn& column : columns) {
    if (column.length > 0) {
      Struct& list = schema.emplace_back();
      list.Integer(3, kRequired);
      list.Text(4, column.name);
      list.Integer(5, 1);
      list.Integer(6, kList);
      Struct& items = schema.emplace_back();
      items.Integer(3, kRepeated);
      items.Text(4, "list");
      items.Integer(5, 1);
    }
    schema.push_back(Leaf(TypeOf(column), column.length > 0 ? "element" : std::string_view(column.name)));
  }
  return schema;
}

/// Adds header and page of a column; returns what the footer says of it.
Struct AppendColumn(const ParquetColumn& column, Bytes* file) {
  const Bytes page = PageOf(column);
  const auto count = static_cast<std::int64_t>(ValuesOf(column)), page_size = static_cast<std::int64_t>(page.size());
  Struct data;
  data.Integer(1, count);
  data.Integer(2, kPlain);
  data.Integer(3, kRle);
  data.Integer(4, kRle);
  Struct header;
  header.Integer(1, kDataPage);
  header.Integer(2, page_size);
  header.Integer(3, page_size);
  header.Add(5, data);
  const Bytes head = header.Whole();
  const auto offset = static_cast<std::int64_t>(file->size()),
             size = static_cast<std::int64_t>(head.size()) + page_size;
  file->insert(file->end(), head.begin(), head.end());
  file->insert(file->end(), page.begin(), page.end());

  std::vector<std::string> path{column.name};
  if (column.length > 0) path.insert(path.end(), {"list", "element"});
  Struct about;
  about.Integer(1, TypeOf(column));
  about.Integers(2, {kPlain, kRle});
  about.Texts(3, path);
  about.Integer(4, kUncompressed);
  about.Integer(5, count, true);
  about.Integer(6, size, true);
  about.Integer(7, size, true);
  about.Integer(9, offset, true);
  Struct chunk;
  chunk.Integer(2, offset, true);
  chunk.Add(3, about);
  return chunk;
}

}  // namespace

std::vector<std::uint8_t> ParquetOf(std::span<const ParquetColumn> columns) {
  if (columns.empty()) throw std::logic_error("ParquetOf: there is no column");
  const std::size_t row_count = ValuesOf(columns.front()) / std::max<std::size_t>(1, columns.front().length);
  for (const ParquetColumn& column : columns) {
    // A file with another number would be read, with rows that do not belong together.
    if (row_count == 0 || ValuesOf(column) != row_count * std::max<std::size_t>(1, column.length)) {
      throw std::logic_error("ParquetOf: column \"" + column.name + "\" has not as many rows as the first, at least 1");
    }
  }
  Bytes file(kMagic.begin(), kMagic.end());
  std::vector<Struct> chunks;
  for (const ParquetColumn& column : columns) chunks.push_back(AppendColumn(column, &file));
  const auto rows = static_cast<std::int64_t>(row_count);
  std::vector<Struct> groups(1);
  groups.front().Structs(1, chunks);
  groups.front().Integer(2, static_cast<std::int64_t>(file.size() - kMagic.size()), true);
  groups.front().Integer(3, rows, true);
  Struct footer;
  footer.Integer(1, 1);
  footer.Structs(2, SchemaOf(columns));
  footer.Integer(3, rows, true);
  footer.Structs(4, groups);
  footer.Text(6, "Fulcrum");
  const Bytes end = footer.Whole();
  file.insert(file.end(), end.begin(), end.end());
  const auto size = static_cast<std::uint32_t>(end.size());
  AppendFixed(&size, sizeof(size), &file);
  file.insert(file.end(), kMagic.begin(), kMagic.end());
  return file;
}

}  // namespace fulcrum::replay
