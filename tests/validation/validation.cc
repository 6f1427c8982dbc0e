#include "tests/validation/validation.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <system_error>
#include <utility>

#include "services/base/core/error.h"

namespace fulcrum::validation {
namespace {

namespace fs = std::filesystem;

constexpr const char* kByCalculix = "calculix";
/// Errors below are at the limit of the references, and their quotient says nothing [%].
constexpr double kLeastForOrder_pct = 0.1;

struct CsvLine {
  std::vector<std::string> fields;
  std::string place;  ///< FILE:LINE.
};

/// Lines after the header, without comments; each has at least `fields` fields, the last of which takes the rest.
std::vector<CsvLine> ReadCsv(const fs::path& file, std::size_t fields) {
  std::ifstream in(file);
  if (!in) throw InputError(file.string() + ": cannot be read; it belongs to the installation");
  std::vector<CsvLine> lines;
  std::string text;
  bool header = true;
  for (int number = 1; std::getline(in, text); ++number) {
    if (text.empty() || text[0] == '#') continue;
    if (std::exchange(header, false)) continue;
    CsvLine line{{}, file.string() + ":" + std::to_string(number)};
    std::size_t at = 0;
    while (line.fields.size() + 1 < fields) {
      const std::size_t comma = text.find(',', at);
      if (comma == std::string::npos) {
        throw InputError(line.place + ": " + std::to_string(fields) + " fields are needed");
      }
      line.fields.push_back(text.substr(at, comma - at));
      at = comma + 1;
    }
    line.fields.push_back(text.substr(at));
    lines.push_back(std::move(line));
  }
  if (lines.empty()) throw InputError(file.string() + ": has no line of values");
  return lines;
}

double Number(const CsvLine& line, std::size_t field) {
  const std::string& text = line.fields[field];
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    throw InputError(line.place + ": \"" + text + "\" is not a finite number");
  }
  return value;
}

/// Error of a measured value [%].
double ErrorOf(double measured, const Expectation& expected) {
  return expected.value == 0 ? measured : 100 * (measured / expected.value - 1);
}

}  // namespace

Expectations ReadExpectations(const fs::path& folder) {
  std::map<std::string, double> computed;
  for (const CsvLine& line : ReadCsv(folder / "calculix.csv", 4)) computed[line.fields[0]] = Number(line, 1);
  Expectations expected;
  for (const CsvLine& line : ReadCsv(folder / "expected.csv", 6)) {
    Expectation one{0, line.fields[2], Number(line, 3), line.fields[4], line.fields[5]};
    if (line.fields[1] != kByCalculix) {
      one.value = Number(line, 1);
    } else if (const auto found = computed.find(line.fields[0]); found != computed.end()) {
      one.value = found->second;
    } else {
      throw InputError(line.place + ": " + line.fields[0] + " is not in calculix.csv; run calculix_references.py");
    }
    if (!(one.tolerance_pct > 0)) throw InputError(line.place + ": a tolerance must be greater than 0");
    expected[line.fields[0]] = std::move(one);
  }
  return expected;
}

bool Row::passed() const { return std::abs(error_pct) <= expected.tolerance_pct; }

std::vector<Row> RunCase(const Case& what, const Expectations& expected) {
  const auto begin = std::chrono::steady_clock::now();
  const Quantities at_default = what.run(Mesh::kDefault);
  const double run_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const std::map<std::string, double> half = [&] {
    const Quantities q = what.run(Mesh::kHalf);
    return std::map<std::string, double>(q.begin(), q.end());
  }();
  const std::map<std::string, double> twice = [&] {
    const Quantities q = what.run(Mesh::kTwice);
    return std::map<std::string, double>(q.begin(), q.end());
  }();
  std::vector<Row> rows;
  for (const auto& [quantity, value] : at_default) {
    const auto known = expected.find(quantity);
    if (known == expected.end()) throw InputError("expected.csv: has no line for " + quantity);
    Row row;
    row.case_name = what.name;
    row.quantity = quantity;
    row.measured = value;
    row.expected = known->second;
    row.error_pct = ErrorOf(value, row.expected);
    row.run_s = run_s;
    if (const auto at = half.find(quantity); at != half.end()) row.half_error_pct = ErrorOf(at->second, row.expected);
    if (const auto at = twice.find(quantity); at != twice.end()) {
      row.twice_error_pct = ErrorOf(at->second, row.expected);
      if (std::min(std::abs(row.error_pct), std::abs(row.twice_error_pct)) > kLeastForOrder_pct) {
        row.order = std::log2(std::abs(row.error_pct / row.twice_error_pct));
      }
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace fulcrum::validation
