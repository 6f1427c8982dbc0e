// The command line of scene_compiler.
#pragma once

#include <string>
#include <vector>

namespace fulcrum::scene_compiler {

struct Arguments {
  std::vector<std::string> plain;    ///< Words without an option: the description; for --list a folder.
  std::vector<std::string> changes;  ///< Values of --set, each "section.key=value".
  std::string out, data, info, source, preview;
  std::string new_name, from, unit, at_mm, facing;  ///< A new scene: its name, its mesh, and what the user says of it.
  std::string anatomy, map;                         ///< A segmentation, and what becomes of its labels.
  double limit_s = 300;
  bool list = false, check = false, quiet = false, help = false;
};

/// Parses the command line. Throws InputError on an unknown option, a missing value, or an option that would have no
/// effect beside the others.
[[nodiscard]] Arguments ParseArguments(const std::vector<std::string>& words);

/// Text of --help.
[[nodiscard]] const char* Usage();

}  // namespace fulcrum::scene_compiler
