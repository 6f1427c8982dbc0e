#include "services/scene/readers/cursor.h"

#include "services/base/core/error.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {
namespace {

constexpr std::size_t kLeastTextBytes = 2;  ///< Smallest size of a value in text: a digit and a separator.

}  // namespace

void RefuseMesh(const std::string& name, const std::string& reason) { throw InputError(name + ": " + reason); }

std::string Quote(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text.substr(0, 40)) {
    quoted += c >= ' ' && c <= '~' ? c : '?';
  }
  return quoted + "'";
}

void Cursor::Fail(const std::string& reason) const {
  if (has_binary_) {
    RefuseMesh(*name_, "byte " + std::to_string(token_) + ": " + reason);
  }
  const auto line = 1 + std::count(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(token_), '\n');
  RefuseMesh(*name_, "line " + std::to_string(line) + ": " + reason);
}

bool Cursor::IsTiny(std::string_view number) {
  double value = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (end != number.data() + number.size()) return false;
  if (error == std::errc()) return std::abs(value) < 1;
  const std::size_t exponent = number.find_first_of("eE");
  return exponent != std::string_view::npos && number.substr(exponent + 1).starts_with('-');
}

void Cursor::FailWord(std::string_view word, const char* what) const {
  Fail(word.empty() ? std::string("the file ends where ") + what + " should be: it was cut short"
                    : Quote(word) + " where " + what + " should be");
}

std::string_view Cursor::WordOfLine() {
  while (at_ < bytes_.size() && IsBlank(bytes_[at_]) && bytes_[at_] != '\n') {
    ++at_;
  }
  token_ = at_;
  if (at_ == bytes_.size() || bytes_[at_] == '\n') {
    return {};
  }
  if (comment_ != '\0' && bytes_[at_] == comment_) {
    at_ = std::min(bytes_.find('\n', at_), bytes_.size());
    return {};
  }
  while (at_ < bytes_.size() && !IsBlank(bytes_[at_]) && (comment_ == '\0' || bytes_[at_] != comment_)) {
    ++at_;
  }
  return bytes_.substr(token_, at_ - token_);
}

std::string_view Cursor::Word() {
  std::string_view word = WordOfLine();
  while (word.empty() && at_ < bytes_.size()) {
    ++at_;  // Skips the end of the line.
    word = WordOfLine();
  }
  return word;
}

void Cursor::Expect(std::string_view word) {
  const std::string_view found = Word();
  if (found != word) {
    FailWord(found, Quote(word).c_str());
  }
}

std::string_view Cursor::Line() {
  token_ = at_;
  const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
  std::string_view line = bytes_.substr(at_, end - at_);
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  at_ = std::min(end + 1, bytes_.size());
  return line;
}

void Cursor::SkipPast(std::string_view mark) {
  token_ = at_;
  const std::size_t found = bytes_.find(mark, at_);
  if (found == std::string_view::npos) {
    Fail("no " + Quote(mark) + " follows: the file was cut short");
  }
  at_ = found + mark.size();
}

void Cursor::Skip(std::size_t count, const char* what) {
  token_ = at_;
  if (count > left()) {
    Fail("the file ends where " + std::string(what) + " should be: " + std::to_string(left()) +
         " bytes left; valid: " + std::to_string(count));
  }
  at_ += count;
}

double Cursor::CheckCoordinate(double value) const {
  if (!(std::abs(value) <= kLargestCoordinate)) {
    Fail("coordinate " + std::to_string(value) + " is not finite or beyond 1e6");
  }
  return value;
}

void Cursor::CheckCount(const char* what, std::uint64_t count, std::size_t values_each, std::size_t bytes_each) const {
  if (count > kMaxMeshElements) {
    Fail(std::to_string(count) + " " + what + "; valid: at most " + std::to_string(kMaxMeshElements));
  }
  // The last value of a text needs no separator after it.
  const std::size_t each = binary_ ? bytes_each : kLeastTextBytes * values_each;
  const std::size_t there = left() + (binary_ ? 0 : 1);
  if (count * each > there) {
    Fail(std::to_string(count) + " " + what + ", but the " + std::to_string(left()) +
         " bytes that follow hold at most " + std::to_string(there / each) +
         ": the count is wrong or the file was cut short");
  }
}

Index Cursor::CheckVertex(std::int64_t number, std::int64_t first, std::size_t count) const {
  if (number < first || static_cast<std::uint64_t>(number - first) >= count) {
    Fail("vertex " + std::to_string(number) + "; valid: " +
         (count == 0 ? "none, for there are no vertices"
                     : std::to_string(first) + " to " + std::to_string(first + static_cast<std::int64_t>(count) - 1)));
  }
  return static_cast<Index>(number - first);
}

}  // namespace fulcrum::scene
