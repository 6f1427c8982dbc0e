// JSON texts for the page.
#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include "services/base/core/json_text.h"
#include "services/records/log_tools/text.h"
#include "services/session/console/screen_text.h"

namespace fulcrum::console {

/// Builder of one object or list.
class Json {
 public:
  explicit Json(char open) : text_(1, open), close_(open == '{' ? '}' : ']') {}
  Json& Raw(std::string_view key, std::string_view value) {
    Next();
    text_.append("\"").append(key).append("\":").append(value);
    return *this;
  }
  Json& Text(std::string_view key, std::string_view value) { return Raw(key, JsonString(ValidUtf8(value))); }
  Json& Flag(std::string_view key, bool value) { return Raw(key, value ? "true" : "false"); }
  /// Adds a number rounded to a multiple of the step: the page shows no more digits, and short texts need less time.
  Json& Number(std::string_view key, double value, double step) { return Raw(key, Rounded(value, step)); }
  Json& Item(std::string_view value) {
    Next();
    text_ += value;
    return *this;
  }
  [[nodiscard]] std::string Done() const { return text_ + close_; }

  static std::string Rounded(double value, double step) {
    std::string text;
    log_tools::text::PutNumber(static_cast<float>(std::round(value / step) * step), &text);
    return text;
  }

 private:
  void Next() {
    if (text_.size() > 1) text_ += ',';
  }
  std::string text_;
  char close_;
};

}  // namespace fulcrum::console
