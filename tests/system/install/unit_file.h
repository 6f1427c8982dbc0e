// A systemd unit as text: its settings, and the command that it starts.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fulcrum::testing {

class UnitFile {
 public:
  /// In the values, `/usr/…`, `/etc/…`, `/var/…` and `/run/…` are replaced by those below `root`.
  UnitFile(const std::filesystem::path& file, const std::filesystem::path& root);

  /// All values of a key, in their order; repeated keys accumulate.
  [[nodiscard]] std::vector<std::string> Values(const std::string& key) const;
  /// The only value, empty when there is none.
  [[nodiscard]] std::string Value(const std::string& key) const;
  /// Words of the value.
  [[nodiscard]] std::vector<std::string> Words(const std::string& key) const;
  /// ExecStart= with `$NAME` replaced by the words of Environment= and EnvironmentFile=.
  [[nodiscard]] std::vector<std::string> Command() const;

 private:
  [[nodiscard]] std::map<std::string, std::string> Environment() const;
  [[nodiscard]] std::string Below(const std::string& text) const;

  std::filesystem::path root_;
  std::multimap<std::string, std::string> values_;
};

[[nodiscard]] std::vector<std::string> SplitWords(const std::string& text);

}  // namespace fulcrum::testing
