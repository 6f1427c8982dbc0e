// Changes of a scene description's parameters, given on a command line.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::scene {

/// Sections whose keys can be changed before a scene is compiled. Of the script only `hand` and `seed` can be changed
/// here, and `power_W` by PowerOfChange.
inline constexpr std::string_view kCompileSections[] = {"physics",   "thermal", "haptics",
                                                        "breathing", "render",  "script"};

/// Of the change `script.power_W=VALUE` the value [W]: the generator's setting, which applies to every key of the
/// script with a power above 0, of the description and of its bases. Nothing for other changes. Throws InputError if
/// the value is no power.
[[nodiscard]] std::optional<double> PowerOfChange(const std::string& change);

/// The description with each change `SECTION.KEY=VALUE` applied. Keys and values are checked when the result is read.
/// Throws InputError if a change has another form or another section; `option` stands for the command line in messages.
[[nodiscard]] std::string ApplyChanges(const std::string& yaml, const std::vector<std::string>& changes,
                                       std::span<const std::string_view> sections, std::string_view option = "--set");

}  // namespace fulcrum::scene
