// The page: files that are compiled into the program.
#pragma once

#include <span>
#include <string_view>

namespace fulcrum::console {

struct PageFile {
  std::string_view path;  ///< Path in the request.
  std::string_view type;
  std::string_view text;
};

[[nodiscard]] std::span<const PageFile> PageFiles();
/// The file of a path; nullptr when there is none.
[[nodiscard]] const PageFile* FindPageFile(std::string_view path);

}  // namespace fulcrum::console
