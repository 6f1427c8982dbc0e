// Reads the bytes of a mesh file, as words of text or as binary values. Files are untrusted: every value is checked
// where it is read, and a count is compared with the remaining bytes before memory is allocated. Every fault is an
// InputError "file: line 12: ..." in text, "file: byte 345: ..." after the first binary data.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

#include "services/base/core/types.h"

namespace fulcrum::scene {

inline constexpr double kLargestCoordinate = 1.0e6;  ///< Larger coordinates mean a broken file, in any unit.

[[noreturn]] void RefuseMesh(const std::string& name, const std::string& reason);

/// At most 40 characters of a file's text, printable in one line.
std::string Quote(std::string_view text);

class Cursor {
 public:
  /// Reads `bytes` from `begin` up to `end`; reported positions count from the beginning of `bytes`, which, like
  /// `name`, must outlive the cursor.
  Cursor(std::string_view bytes, const std::string& name, std::size_t begin = 0,
         std::size_t end = std::string_view::npos)
      : bytes_(bytes.substr(0, std::min(end, bytes.size()))), name_(&name), at_(std::min(begin, bytes_.size())) {}

  [[nodiscard]] const std::string& name() const { return *name_; }
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] bool binary() const { return binary_; }

  /// From here on Take() reads binary values, with their bytes in the other order when `swap`.
  void SetBinary(bool swap) {
    binary_ = true;
    has_binary_ = true;
    swap_ = swap;
  }
  void SetText() { binary_ = false; }

  // ------------------------------------------------------------------------------------------------------- text

  /// Makes this character begin a comment that extends to the end of the line.
  void set_comment(char c) { comment_ = c; }
  /// The next word; empty at the end.
  std::string_view Word();
  /// The next word of this line; empty at its end.
  std::string_view WordOfLine();
  /// Reads the next word, which must be this one.
  void Expect(std::string_view word);
  /// Returns the rest of the line, without its end, and skips the end of the line.
  std::string_view Line();
  /// Skips the text up to and including the next `mark`; fails if there is none.
  void SkipPast(std::string_view mark);

  // -------------------------------------------------------------------------------------------- text or binary

  /// The next value: a word of text, or sizeof(T) bytes. `what` names it in an error message.
  template <class T>
  T Take(const char* what) {
    return binary_ ? TakeBinary<T>(what) : TakeText<T>(what);
  }
  /// The next value as a coordinate: finite and within kLargestCoordinate.
  template <class T>
  double TakeCoordinate() {
    return CheckCoordinate(static_cast<double>(Take<T>("a coordinate")));
  }
  /// The next value as a count of items that have `values_each` (at least one) values of T each.
  template <class T>
  std::size_t TakeCount(const char* what, std::size_t values_each, std::size_t bytes_each);
  /// Refuses a count of items that exceeds the remaining bytes or the limit of any mesh. An item has `values_each`
  /// values in text, `bytes_each` bytes in binary data.
  void CheckCount(const char* what, std::uint64_t count, std::size_t values_each, std::size_t bytes_each) const;
  double CheckCoordinate(double value) const;
  /// Checks that `number`, counted from `first`, is an index below `count`, and returns that index.
  Index CheckVertex(std::int64_t number, std::int64_t first, std::size_t count) const;
  /// Throws with the position of the value that was read last.
  [[noreturn]] void Fail(const std::string& reason) const;
  /// Skips `count` bytes.
  void Skip(std::size_t count, const char* what);

 private:
  [[nodiscard]] static bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  /// True for a number such as 3.7e-49, which is too small for a float: rounding noise of a program that computes in
  /// double.
  [[nodiscard]] static bool IsTiny(std::string_view number);
  [[noreturn]] void FailWord(std::string_view word, const char* what) const;

  template <class T>
  T TakeText(const char* what) {
    const std::string_view full = Word();
    std::string_view word = full;
    if (word.starts_with('+')) {
      word.remove_prefix(1);
    }
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (std::is_floating_point_v<T> && error == std::errc::result_out_of_range && IsTiny(word)) {
      return T{0};
    }
    if (word.empty() || error != std::errc() || end != word.data() + word.size()) {
      FailWord(full, what);
    }
    return value;
  }

  template <class T>
  T TakeBinary(const char* what) {
    std::array<char, sizeof(T)> raw;
    const std::size_t from = at_;
    Skip(raw.size(), what);
    std::memcpy(raw.data(), bytes_.data() + from, raw.size());
    if (swap_) {
      std::reverse(raw.begin(), raw.end());
    }
    T value;
    std::memcpy(&value, raw.data(), raw.size());
    return value;
  }

  std::string_view bytes_;
  const std::string* name_;
  std::size_t at_;
  std::size_t token_ = 0;  ///< Position of the value that was read last.
  char comment_ = '\0';
  bool binary_ = false, swap_ = false;
  bool has_binary_ = false;  ///< After the first binary data, line numbers have no meaning.
};

template <class T>
std::size_t Cursor::TakeCount(const char* what, std::size_t values_each, std::size_t bytes_each) {
  const T count = Take<T>(what);
  if (std::is_signed_v<T> && count < 0) {
    Fail(std::to_string(count) + " " + what + "; valid: 0 and above");
  }
  CheckCount(what, static_cast<std::uint64_t>(count), values_each, bytes_each);
  return static_cast<std::size_t>(count);
}

}  // namespace fulcrum::scene
