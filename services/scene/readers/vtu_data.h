// The values of a data array of a VTK XML file, in any of its encodings.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::scene {

/// Encoding of binary data in a file.
struct VtuEncoding {
  bool swap = false;         ///< The byte order differs from that of this machine.
  bool long_header = false;  ///< Sizes have 64 bits instead of 32.
  bool compressed = false;   ///< Blocks compressed by zlib.
};

enum class VtuForm { kText, kBase64, kRaw };

/// Position and encoding of an array's values.
struct VtuArray {
  VtuForm form = VtuForm::kText;
  std::string type;                ///< "Float32" …
  std::size_t begin = 0, end = 0;  ///< Positions in the file. The end may lie beyond other arrays.
  bool present = false;
};

/// Reads exactly `count` values. Throws InputError "file: place: reason" before allocating memory that the array's
/// bytes cannot fill.
std::vector<double> ReadVtuNumbers(std::string_view bytes, const std::string& name, const VtuEncoding& encoding,
                                   const VtuArray& array, const char* what, std::uint64_t count);
/// As ReadVtuNumbers, for arrays of integers. Values of UInt64 beyond those of Int64 are refused.
std::vector<std::int64_t> ReadVtuIntegers(std::string_view bytes, const std::string& name, const VtuEncoding& encoding,
                                          const VtuArray& array, const char* what, std::uint64_t count);

}  // namespace fulcrum::scene
