#include "services/session/supervisor/flat_json.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "services/base/core/json_text.h"

namespace fulcrum::supervisor {

void FlatJson::Add(const std::string& key, const std::string& value) { AddRaw(key, JsonString(value)); }
void FlatJson::Add(const std::string& key, const char* value) { AddRaw(key, JsonString(value)); }
void FlatJson::Add(const std::string& key, bool value) { AddRaw(key, value ? "true" : "false"); }
void FlatJson::Add(const std::string& key, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  AddRaw(key, std::isfinite(value) ? text.data() : "null");
}

void FlatJson::AddRaw(const std::string& key, const std::string& value) {
  body_ += body_.empty() ? "\n  " : ",\n  ";
  body_ += JsonString(key);
  body_ += ": ";
  body_ += value;
}

}  // namespace fulcrum::supervisor
