#include "tests/system/install/unit_file.h"

#include <regex>
#include <sstream>
#include <stdexcept>

#include "tests/support/cart.h"

namespace fulcrum::testing {

std::vector<std::string> SplitWords(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

UnitFile::UnitFile(const std::filesystem::path& file, const std::filesystem::path& root) : root_(root) {
  std::istringstream lines(ReadFile(file));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t equals = line.find('=');
    if (line.empty() || line[0] == '#' || line[0] == '[') continue;
    if (equals == std::string::npos) throw std::runtime_error(file.string() + ": \"" + line + "\" says nothing");
    values_.emplace(line.substr(0, equals), line.substr(equals + 1));
  }
  if (values_.empty()) throw std::runtime_error(file.string() + ": nothing in it");
}

std::string UnitFile::Below(const std::string& text) const {
  static const std::regex kPlace("(^|[ =-])(/(usr|etc|var|run)/)");
  return std::regex_replace(text, kPlace, "$1" + root_.string() + "$2");
}

std::vector<std::string> UnitFile::Values(const std::string& key) const {
  std::vector<std::string> values;
  const auto [begin, end] = values_.equal_range(key);
  for (auto it = begin; it != end; ++it) values.push_back(Below(it->second));
  return values;
}

std::string UnitFile::Value(const std::string& key) const {
  const std::vector<std::string> values = Values(key);
  if (values.size() > 1) throw std::runtime_error(key + " is given more than once");
  return values.empty() ? "" : values.front();
}

std::vector<std::string> UnitFile::Words(const std::string& key) const { return SplitWords(Value(key)); }

std::map<std::string, std::string> UnitFile::Environment() const {
  std::map<std::string, std::string> environment;
  const auto add = [&](const std::string& assignment) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos || assignment[0] == '#') return;
    std::string value = assignment.substr(equals + 1);
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
    environment[assignment.substr(0, equals)] = value;
  };
  for (const std::string& values : Values("Environment")) {
    for (const std::string& assignment : SplitWords(values)) add(assignment);
  }
  for (std::string file : Values("EnvironmentFile")) {
    if (file.starts_with('-')) file.erase(0, 1);
    std::istringstream lines(ReadFile(file));
    for (std::string line; std::getline(lines, line);) add(line);
  }
  return environment;
}

std::vector<std::string> UnitFile::Command() const {
  const std::map<std::string, std::string> environment = Environment();
  std::vector<std::string> command;
  for (const std::string& word : Words("ExecStart")) {
    if (!word.starts_with('$')) {
      command.push_back(word);
      continue;
    }
    const auto found = environment.find(word.substr(1));
    if (found == environment.end()) continue;
    for (const std::string& part : SplitWords(found->second)) command.push_back(part);
  }
  return command;
}

}  // namespace fulcrum::testing
