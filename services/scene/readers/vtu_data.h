// The values of a data array of a VTK XML file, whichever way they are written.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::scene {

/// A file's own way to write binary data.
struct VtuEncoding {
  bool swap = false;         ///< The other order of bytes than this machine's.
  bool long_header = false;  ///< Sizes are of 64 bits instead of 32.
  bool compressed = false;   ///< Blocks compressed by zlib.
};

enum class VtuForm { kText, kBase64, kRaw };

/// Where an array's values stand and how.
struct VtuArray {
  VtuForm form = VtuForm::kText;
  std::string type;                ///< "Float32" …
  std::size_t begin = 0, end = 0;  ///< In the file. The end may lie behind other arrays.
  bool present = false;
};

/// `count` values, no more and no fewer. Throws InputError "file: place: reason", before it asks for memory that the
/// array's bytes cannot fill.
std::vector<double> ReadVtuNumbers(std::string_view bytes, const std::string& name, const VtuEncoding& encoding,
                                   const VtuArray& array, const char* what, std::uint64_t count);
/// The same for arrays of integers. Values of UInt64 beyond those of Int64 are refused.
std::vector<std::int64_t> ReadVtuIntegers(std::string_view bytes, const std::string& name, const VtuEncoding& encoding,
                                          const VtuArray& array, const char* what, std::uint64_t count);

}  // namespace fulcrum::scene
