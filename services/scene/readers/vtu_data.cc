#include "services/scene/readers/vtu_data.h"

#include <zlib.h>

#include "services/scene/readers/cursor.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {
namespace {

constexpr std::uint64_t kDeflateRatio = 1032;  ///< Largest compression ratio of zlib's format.

/// Value of a base64 digit; -1 for any other character.
int Base64Digit(char c) {
  if (c >= 'A' && c <= 'Z') {
    return c - 'A';
  }
  if (c >= 'a' && c <= 'z') {
    return c - 'a' + 26;
  }
  if (c >= '0' && c <= '9') {
    return c - '0' + 52;
  }
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/// The bytes of an array, from raw or base64 text. Base64 may contain padding in the middle: some writers encode header
/// and data separately.
class ByteStream {
 public:
  ByteStream(std::string_view bytes, const std::string& name, const VtuArray& array)
      : bytes_(bytes), name_(name), at_(array.begin), end_(array.end), raw_(array.form == VtuForm::kRaw) {}

  /// Whether the remaining data can contain at least `count` bytes.
  [[nodiscard]] bool MayHold(std::uint64_t count) const {
    return count <= (raw_ ? end_ - at_ : (end_ - at_) / 4 * 3 + 3 + group_.size());
  }
  [[nodiscard]] std::size_t at() const { return at_; }

  std::string Take(std::uint64_t count, const char* what) {
    if (!MayHold(count)) {
      FailShort(count, what);
    }
    std::string taken;
    if (raw_) {
      taken = bytes_.substr(at_, count);
      at_ += count;
      return taken;
    }
    taken.reserve(count);
    while (taken.size() < count) {
      if (group_.empty() && !NextGroup()) {
        FailShort(count, what);
      }
      const std::size_t part = std::min<std::size_t>(group_.size(), count - taken.size());
      taken += group_.substr(0, part);
      group_.erase(0, part);
    }
    return taken;
  }

  [[noreturn]] void Fail(const std::string& reason) const {
    RefuseMesh(name_, "byte " + std::to_string(at_) + ": " + reason);
  }

 private:
  [[noreturn]] void FailShort(std::uint64_t count, const char* what) const {
    Fail("the data end where " + std::to_string(count) + " bytes of " + what +
         " should be: a size is wrong or the file was cut short");
  }

  /// Decodes four digits to one to three bytes; false at the end.
  bool NextGroup() {
    std::uint32_t bits = 0;
    int digits = 0, padding = 0;
    while (digits + padding < 4) {
      while (at_ < end_ && (bytes_[at_] == ' ' || bytes_[at_] == '\n' || bytes_[at_] == '\r' || bytes_[at_] == '\t')) {
        ++at_;
      }
      if (at_ >= end_) {
        return false;
      }
      const char c = bytes_[at_];
      const int digit = Base64Digit(c);
      if (c == '=' && digits >= 2) {
        ++padding;
      } else if (digit < 0 || padding > 0) {
        Fail(Quote(bytes_.substr(at_, 1)) + " where a digit of base64 should be");
      } else {
        bits |= static_cast<std::uint32_t>(digit) << (18 - 6 * digits);
        ++digits;
      }
      ++at_;
    }
    for (int k = 0; k + 1 < digits; ++k) {
      group_ += static_cast<char>((bits >> (16 - 8 * k)) & 0xff);
    }
    return true;
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_, end_;
  bool raw_;
  std::string group_;  ///< Decoded, but not read yet.
};

std::uint64_t TakeSize(ByteStream* in, const VtuEncoding& encoding) {
  std::string raw = in->Take(encoding.long_header ? 8 : 4, "a size");
  if (encoding.swap) {
    std::reverse(raw.begin(), raw.end());
  }
  if (encoding.long_header) {
    std::uint64_t value = 0;
    std::memcpy(&value, raw.data(), sizeof(value));
    return value;
  }
  std::uint32_t value = 0;
  std::memcpy(&value, raw.data(), sizeof(value));
  return value;
}

/// Reads blocks of equal size, the last of another size, each compressed separately.
std::string TakeCompressed(ByteStream* in, const VtuEncoding& encoding, const char* what, std::uint64_t wanted) {
  const std::uint64_t blocks = TakeSize(in, encoding), block = TakeSize(in, encoding), last = TakeSize(in, encoding);
  if (blocks > kMaxMeshBytes || !in->MayHold(blocks * (encoding.long_header ? 8 : 4))) {
    in->Fail(std::to_string(blocks) + " compressed blocks of " + what + ", more than the data can hold");
  }
  // The header contains the size of a last block of another size; a single block may be announced far larger than it
  // is. No product here overflows: blocks is below 2^31 here, and block below 2^32 where it is used.
  const std::uint64_t full = last > 0 && blocks > 0 ? blocks - 1 : blocks;
  if ((full > 0 && block > wanted) || last > wanted || full * block + last != wanted) {
    in->Fail(std::to_string(blocks) + " compressed blocks of " + std::to_string(block) + " bytes, the last of " +
             std::to_string(last) + ", for " + what + "; valid: " + std::to_string(wanted) + " bytes in all");
  }
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t i = 0; i < blocks; ++i) {
    sizes.push_back(TakeSize(in, encoding));
  }
  std::string data;
  for (std::uint64_t i = 0; i < blocks; ++i) {
    const std::uint64_t size = i < full ? block : last;
    if (sizes[i] > kMaxMeshBytes || size > kDeflateRatio * (sizes[i] + 1)) {
      in->Fail("a block of " + std::to_string(sizes[i]) + " bytes cannot hold " + std::to_string(size) + " bytes of " +
               what);
    }
    const std::string packed = in->Take(sizes[i], what);
    const std::size_t before = data.size();
    data.resize(before + size);
    uLongf got = size;
    const int status = uncompress(reinterpret_cast<Bytef*>(data.data() + before), &got,
                                  reinterpret_cast<const Bytef*>(packed.data()), packed.size());
    if (status != Z_OK || got != size) {
      in->Fail("a compressed block of " + std::string(what) + " is damaged (zlib's status " + std::to_string(status) +
               ", " + std::to_string(got) + " bytes; valid: " + std::to_string(size) + ")");
    }
  }
  return data;
}

std::string TakePlain(ByteStream* in, const VtuEncoding& encoding, const char* what, std::uint64_t wanted) {
  const std::uint64_t size = TakeSize(in, encoding);
  if (size != wanted) {
    in->Fail(std::to_string(size) + " bytes of " + what + "; valid: " + std::to_string(wanted));
  }
  return in->Take(size, what);
}

std::size_t SizeOf(const std::string& type) {
  if (type == "Int8" || type == "UInt8") {
    return 1;
  }
  if (type == "Int16" || type == "UInt16") {
    return 2;
  }
  if (type == "Int32" || type == "UInt32" || type == "Float32") {
    return 4;
  }
  return 8;
}

template <class From, class To>
void TakeAll(Cursor* in, const char* what, std::uint64_t count, std::vector<To>* values) {
  for (std::uint64_t i = 0; i < count; ++i) {
    const From value = in->Take<From>(what);
    if constexpr (std::is_same_v<From, std::uint64_t>) {
      if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
        in->Fail(std::to_string(value) + " is too large for " + what);
      }
    }
    values->push_back(static_cast<To>(value));
  }
}

/// Reads a value; in text a byte is a number too, not a character.
template <class T>
void TakeTyped(Cursor* in, const std::string& type, const char* what, std::uint64_t count, std::vector<T>* values) {
  if constexpr (std::is_floating_point_v<T>) {
    type == "Float32" ? TakeAll<float>(in, what, count, values) : TakeAll<double>(in, what, count, values);
  } else if (!in->binary() || type == "Int64") {
    TakeAll<std::int64_t>(in, what, count, values);
  } else if (type == "Int8") {
    TakeAll<std::int8_t>(in, what, count, values);
  } else if (type == "UInt8") {
    TakeAll<std::uint8_t>(in, what, count, values);
  } else if (type == "Int16") {
    TakeAll<std::int16_t>(in, what, count, values);
  } else if (type == "UInt16") {
    TakeAll<std::uint16_t>(in, what, count, values);
  } else if (type == "Int32") {
    TakeAll<std::int32_t>(in, what, count, values);
  } else if (type == "UInt32") {
    TakeAll<std::uint32_t>(in, what, count, values);
  } else {
    TakeAll<std::uint64_t>(in, what, count, values);
  }
}

template <class T>
std::vector<T> ReadArray(std::string_view bytes, const std::string& name, const VtuEncoding& encoding,
                         const VtuArray& array, const char* what, std::uint64_t count) {
  Cursor text(bytes, name, array.begin, array.end);
  constexpr bool kIsFloat = std::is_floating_point_v<T>;
  if (array.type.starts_with("Float") != kIsFloat) {
    text.Fail(std::string(what) + " of type " + Quote(array.type) +
              "; valid: " + (kIsFloat ? "Float32, Float64" : "Int8 to Int64, UInt8 to UInt64"));
  }
  std::vector<T> values;
  if (array.form == VtuForm::kText) {
    text.CheckCount(what, count, 1, 1);
    values.reserve(count);
    TakeTyped(&text, array.type, what, count, &values);
    if (!text.Word().empty()) {
      text.Fail(std::string("more than the ") + std::to_string(count) + " values of " + what);
    }
    return values;
  }
  if (count > kMaxMeshElements * 4) {
    text.Fail(std::to_string(count) + " values of " + what + "; valid: at most " +
              std::to_string(kMaxMeshElements * 4));
  }
  if (count == 0) {
    return values;
  }
  ByteStream stream(bytes, name, array);
  const std::uint64_t wanted = count * SizeOf(array.type);
  const std::string data = encoding.compressed ? TakeCompressed(&stream, encoding, what, wanted)
                                               : TakePlain(&stream, encoding, what, wanted);
  const std::string data_name = name + ": data of " + what;
  Cursor in(data, data_name);
  in.SetBinary(encoding.swap);
  values.reserve(count);
  TakeTyped(&in, array.type, what, count, &values);
  return values;
}

}  // namespace

std::vector<double> ReadVtuNumbers(std::string_view bytes, const std::string& name, const VtuEncoding& encoding,
                                   const VtuArray& array, const char* what, std::uint64_t count) {
  return ReadArray<double>(bytes, name, encoding, array, what, count);
}

std::vector<std::int64_t> ReadVtuIntegers(std::string_view bytes, const std::string& name, const VtuEncoding& encoding,
                                          const VtuArray& array, const char* what, std::uint64_t count) {
  return ReadArray<std::int64_t>(bytes, name, encoding, array, what, count);
}

}  // namespace fulcrum::scene
