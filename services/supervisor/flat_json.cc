#include "services/supervisor/flat_json.h"

#include <array>
#include <cmath>
#include <cstdio>

namespace fulcrum::supervisor {
namespace {

std::string Quote(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20) {
      std::array<char, 8> escaped{};
      std::snprintf(escaped.data(), escaped.size(), "\\u%04x", byte);
      quoted += escaped.data();
    } else {
      quoted += c;
    }
  }
  quoted += '"';
  return quoted;
}

}  // namespace

void FlatJson::Add(const std::string& key, const std::string& value) { AddRaw(key, Quote(value)); }
void FlatJson::Add(const std::string& key, const char* value) { AddRaw(key, Quote(value)); }
void FlatJson::Add(const std::string& key, bool value) { AddRaw(key, value ? "true" : "false"); }
void FlatJson::Add(const std::string& key, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  AddRaw(key, std::isfinite(value) ? text.data() : "null");
}

void FlatJson::AddRaw(const std::string& key, const std::string& value) {
  body_ += body_.empty() ? "\n  " : ",\n  ";
  body_ += Quote(key);
  body_ += ": ";
  body_ += value;
}

}  // namespace fulcrum::supervisor
