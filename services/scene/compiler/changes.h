// Changes of a scene description's parameters, given on a command line.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::scene {

/// Sections whose keys can be changed before a scene is compiled. Of the script only these can be
/// changed: `power_W`, the generator's setting, which applies to every key with a power above 0; `hand` and `seed`.
inline constexpr std::string_view kCompileSections[] = {"physics",   "thermal", "haptics",
                                                        "breathing", "render",  "script"};

/// The description with each change `SECTION.KEY=VALUE` applied. Keys and values are checked when the result is read.
/// Throws InputError if a change has another form or another section; `option` stands for the command line in messages.
[[nodiscard]] std::string ApplyChanges(const std::string& yaml, const std::vector<std::string>& changes,
                                       std::span<const std::string_view> sections, std::string_view option = "--set");

}  // namespace fulcrum::scene
