// A table as the bytes of an Apache Parquet file (parquet.apache.org), the least that readers need: one group of rows,
// a page a column, encoding PLAIN, not compressed. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace fulcrum::replay {

struct ParquetColumn {
  std::string name;
  std::variant<std::vector<float>, std::vector<std::int64_t>, std::vector<bool>> values;
  std::size_t length = 0;  ///< 0: a value a row; otherwise each row is a list of so many values.
};

/// No value is null. Equal tables give equal bytes. Throws std::logic_error unless there is at least one column and all
/// have equally many rows, at least one.
[[nodiscard]] std::vector<std::uint8_t> ParquetOf(std::span<const ParquetColumn> columns);

}  // namespace fulcrum::replay
