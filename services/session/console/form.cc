#include "services/session/console/form.h"

#include <algorithm>
#include <charconv>

namespace fulcrum::console {
namespace {

constexpr std::size_t kLongestForm = 4096;
constexpr std::size_t kMostFields = 32;
constexpr std::size_t kLongestName = 96;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsLower(char c) { return c >= 'a' && c <= 'z'; }
bool IsPlain(char c) { return IsDigit(c) || IsLower(c) || (c >= 'A' && c <= 'Z') || c == '.' || c == '-' || c == '_'; }

int HexValue(char c) {
  if (IsDigit(c)) return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::optional<std::string> Decode(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i] == '+' ? ' ' : text[i];
    if (c == '%') {
      const int high = i + 2 < text.size() ? HexValue(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? HexValue(text[i + 2]) : -1;
      if (high < 0 || low < 0) return {};
      c = static_cast<char>(high * 16 + low);
      i += 2;
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return {};
    out += c;
  }
  return out;
}

}  // namespace

std::optional<Form> ParseForm(std::string_view text) {
  Form form;
  if (text.size() > kLongestForm) return {};
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('&'), text.size());
    const std::string_view field = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos || equals == 0) return {};
    const std::string_view name = field.substr(0, equals);
    std::optional<std::string> value = Decode(field.substr(equals + 1));
    const bool plain = std::all_of(name.begin(), name.end(), [](char c) { return IsLower(c) || c == '_'; });
    if (!plain || !value || form.size() == kMostFields || !form.emplace(name, *std::move(value)).second) return {};
  }
  return form;
}

std::optional<Target> ParseTarget(std::string_view text) {
  const std::size_t end = std::min(text.find('?'), text.size());
  const std::string_view path = text.substr(0, end);
  if (path.empty() || path.front() != '/' || path.size() > 2 * kLongestName) return {};
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path[i] != '/' && !IsPlain(path[i])) return {};
    if (i > 0 && path[i - 1] == '/' && (path[i] == '/' || path[i] == '.')) return {};
  }
  std::optional<Form> query = ParseForm(end == text.size() ? std::string_view() : text.substr(end + 1));
  if (!query) return {};
  return Target{std::string(path), *std::move(query)};
}

bool IsPlainName(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName && text.front() != '.' &&
         std::all_of(text.begin(), text.end(), IsPlain);
}

bool IsPictureName(std::string_view text) {
  constexpr std::string_view kBegin = "frame_", kEnd = ".png";
  if (!text.starts_with(kBegin) || !text.ends_with(kEnd) || text.size() <= kBegin.size() + kEnd.size()) return false;
  const std::string_view digits = text.substr(kBegin.size(), text.size() - kBegin.size() - kEnd.size());
  return digits.size() <= 12 && std::all_of(digits.begin(), digits.end(), IsDigit);
}

bool IsRecordingName(std::string_view text) {
  const std::size_t slash = text.find('/');
  return slash != std::string_view::npos && IsPlainName(text.substr(0, slash)) && IsPlainName(text.substr(slash + 1)) &&
         text.ends_with(".mcap");
}

std::optional<double> ParseNumber(std::string_view text, double least, double most) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size() || !(value >= least && value <= most)) return {};
  return value;
}

}  // namespace fulcrum::console
