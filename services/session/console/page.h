// The page: files that were put into the program when it was built.
#pragma once

#include <span>
#include <string_view>

namespace fulcrum::console {

struct PageFile {
  std::string_view path;  ///< As it is asked for.
  std::string_view type;
  std::string_view text;
};

[[nodiscard]] std::span<const PageFile> PageFiles();
/// nullptr: there is no such file.
[[nodiscard]] const PageFile* FindPageFile(std::string_view path);

}  // namespace fulcrum::console
