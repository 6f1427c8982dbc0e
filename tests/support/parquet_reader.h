// Reads the tables that services/apps/replayer/parquet_file.h writes, from the format's description and independent of
// the writer: Thrift's compact protocol, levels as runs, values PLAIN.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace fulcrum::testing {

/// A value of Thrift's compact protocol.
struct ThriftValue {
  std::int64_t integer = 0;
  std::string text;
  std::vector<ThriftValue> list;
  std::map<int, ThriftValue> fields;
};

class ThriftReader {
 public:
  ThriftReader(const std::string& bytes, std::size_t at) : bytes_(bytes), at_(at) {}
  [[nodiscard]] std::size_t at() const { return at_; }
  ThriftValue Struct() {
    ThriftValue value;
    for (int field = 0;;) {
      const std::uint8_t head = Byte();
      if (head == 0) return value;
      if (head >> 4 == 0) throw std::runtime_error("a field's number is written in full: not expected");
      field += head >> 4;
      value.fields[field] = Value(head & 15);
    }
  }
  std::uint64_t Varint() {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint8_t byte = Byte();
      value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
      if (byte < 0x80) return value;
    }
  }
  std::uint8_t Byte() { return static_cast<std::uint8_t>(bytes_.at(at_++)); }

 private:
  ThriftValue Value(int type) {
    ThriftValue value;
    if (type == 5 || type == 6) {
      const std::uint64_t zigzag = Varint();
      value.integer = static_cast<std::int64_t>(zigzag >> 1) ^ -static_cast<std::int64_t>(zigzag & 1);
    } else if (type == 8) {
      const std::uint64_t size = Varint();
      value.text = bytes_.substr(at_, size);
      at_ += size;
    } else if (type == 9) {
      const std::uint8_t head = Byte();
      std::uint64_t size = head >> 4;
      if (size == 15) size = Varint();
      for (std::uint64_t i = 0; i < size; ++i) value.list.push_back(Value(head & 15));
    } else if (type == 12) {
      value = Struct();
    } else {
      throw std::runtime_error("Thrift type " + std::to_string(type));
    }
    return value;
  }

  const std::string& bytes_;
  std::size_t at_;
};

struct ParquetTable {
  struct Column {
    int type = 0;                             ///< 0 boolean, 2 int64, 4 float.
    std::vector<std::vector<double>> values;  ///< By row.
    std::vector<std::string> path;            ///< In the schema.
    int codec = -1;                           ///< 0: not compressed.
    std::vector<int> encodings;               ///< As the footer lists them: 0 PLAIN, 3 RLE.
    std::vector<int> page_encodings;          ///< Of values, definition levels, repetition levels.
  };
  /// An element of the schema; -1 where the file has no such field.
  struct Element {
    std::string name;
    int type = -1, repetition = -1, children = -1, converted = -1;
    bool operator==(const Element&) const = default;
  };
  std::int64_t rows = 0;
  std::map<std::string, Column> columns;
  std::vector<Element> schema;
};

/// Runs of levels of one bit, until there are `count`.
inline std::vector<int> LevelsAt(const std::string& file, std::size_t* at, std::size_t count) {
  std::uint32_t size = 0;
  std::memcpy(&size, file.data() + *at, 4);
  ThriftReader runs(file, *at + 4);
  std::vector<int> levels;
  while (levels.size() < count) {
    const std::uint64_t head = runs.Varint();
    if ((head & 1) != 0) throw std::runtime_error("packed levels: not expected");
    levels.insert(levels.end(), head >> 1, runs.Byte());
  }
  *at += 4 + size;
  if (runs.at() != *at || levels.size() != count) throw std::runtime_error("the levels have another size");
  return levels;
}

inline double PlainValue(const std::string& file, std::size_t at, int type, std::size_t i) {
  if (type == 0) return static_cast<std::uint8_t>(file.at(at + i / 8)) >> (i % 8) & 1;
  if (type == 2) {
    std::int64_t value = 0;
    std::memcpy(&value, file.substr(at + 8 * i, 8).data(), 8);
    return static_cast<double>(value);
  }
  float value = 0;
  std::memcpy(&value, file.substr(at + 4 * i, 4).data(), 4);
  return static_cast<double>(value);
}

/// Throws std::runtime_error or std::out_of_range where the file is not what its footer says.
inline ParquetTable ReadParquet(const std::string& file) {
  if (!file.starts_with("PAR1") || !file.ends_with("PAR1")) throw std::runtime_error("no Parquet");
  std::uint32_t footer_size = 0;
  std::memcpy(&footer_size, file.data() + file.size() - 8, 4);
  ThriftReader reader(file, file.size() - 8 - footer_size);
  ThriftValue footer = reader.Struct();
  if (reader.at() != file.size() - 8) throw std::runtime_error("the footer has another size");
  ParquetTable table;
  table.rows = footer.fields.at(3).integer;
  for (const ThriftValue& element : footer.fields.at(2).list) {
    const auto number = [&](int field) {
      const auto found = element.fields.find(field);
      return found == element.fields.end() ? -1 : static_cast<int>(found->second.integer);
    };
    table.schema.push_back({element.fields.at(4).text, number(1), number(3), number(5), number(6)});
  }
  std::size_t end = 4;  // Of the page before.
  for (ThriftValue& chunk : footer.fields.at(4).list.at(0).fields.at(1).list) {
    auto& about = chunk.fields.at(3).fields;
    const auto offset = static_cast<std::size_t>(about.at(9).integer);
    if (offset != end) throw std::runtime_error("pages do not follow each other");
    end = offset + static_cast<std::size_t>(about.at(7).integer);
    ThriftReader head(file, offset);
    ThriftValue page = head.Struct();
    std::size_t at = head.at();
    if (at + static_cast<std::size_t>(page.fields.at(3).integer) != end) throw std::runtime_error("size of a page");
    const auto count = static_cast<std::size_t>(page.fields.at(5).fields.at(1).integer);
    const auto& path = about.at(3).list;
    std::vector<int> begins(count, 0);
    if (path.size() == 3) {
      begins = LevelsAt(file, &at, count);
      for (const int level : LevelsAt(file, &at, count)) {
        if (level != 1) throw std::runtime_error("a value is null");
      }
    }
    ParquetTable::Column& column = table.columns[path.front().text];
    column.type = static_cast<int>(about.at(1).integer);
    column.codec = static_cast<int>(about.at(4).integer);
    for (const ThriftValue& part : path) column.path.push_back(part.text);
    for (const ThriftValue& each : about.at(2).list) column.encodings.push_back(static_cast<int>(each.integer));
    for (const int field : {2, 3, 4}) {
      column.page_encodings.push_back(static_cast<int>(page.fields.at(5).fields.at(field).integer));
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (begins[i] == 0) column.values.emplace_back();
      column.values.back().push_back(PlainValue(file, at, column.type, i));
    }
    const std::size_t bytes = column.type == 0 ? (count + 7) / 8 : (column.type == 2 ? 8 : 4) * count;
    if (at + bytes != end) throw std::runtime_error("the values have another size");
  }
  return table;
}

}  // namespace fulcrum::testing
