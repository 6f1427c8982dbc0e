// Text with numbers, by the formats of printf.
#pragma once

#include <cstdio>
#include <string>

namespace fulcrum::scene {

template <class... Values>
std::string PrintText(const char* format, Values... values) {
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...)) + 1, '\0');
  std::snprintf(text.data(), text.size(), format, values...);
  text.pop_back();
  return text;
}

}  // namespace fulcrum::scene
