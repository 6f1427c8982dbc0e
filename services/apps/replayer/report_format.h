// Text for reports. Internal to services/apps/replayer.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "services/base/core/error.h"
#include "services/base/core/json_text.h"

namespace fulcrum::replay {

__attribute__((format(printf, 1, 2))) inline std::string Format(const char* format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof(text), format, arguments);
  va_end(arguments);
  return text;
}

/// Writes `file`. Throws InputError when it cannot be written.
inline void WriteText(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw InputError(file.string() + ": cannot be written");
}

}  // namespace fulcrum::replay
