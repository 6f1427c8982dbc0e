// The command line of scene_compiler.
#pragma once

#include <string>
#include <vector>

namespace fulcrum::scene_compiler {

struct Arguments {
  std::vector<std::string> plain;    ///< Without an option before them: the description; for --list a folder.
  std::vector<std::string> changes;  ///< --set, "section.key=value" each.
  std::string out, data, info, source;
  bool list = false, quiet = false, help = false;
};

/// Throws InputError on an unknown option or a missing value.
[[nodiscard]] Arguments ParseArguments(const std::vector<std::string>& words);

/// What --help prints.
[[nodiscard]] const char* Usage();

}  // namespace fulcrum::scene_compiler
