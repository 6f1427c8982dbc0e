// A scene description with some of its parameters changed, from a command line.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::scene {

/// What can be changed before a scene is compiled. Of the script it is `script.power_W=VALUE` alone, the generator's
/// setting: every key that asks for power asks for that.
inline constexpr std::string_view kCompileSections[] = {"physics",   "thermal", "haptics",
                                                        "breathing", "render",  "script"};

/// The description with each change `SECTION.KEY=VALUE` made. Keys and values are checked by whoever reads the result.
/// Throws InputError when a change is not of the form, or of another section; `option` stands for the command line in
/// messages.
[[nodiscard]] std::string ApplyChanges(const std::string& yaml, const std::vector<std::string>& changes,
                                       std::span<const std::string_view> sections, std::string_view option = "--set");

}  // namespace fulcrum::scene
