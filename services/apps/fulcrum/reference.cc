#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>

#include "services/apps/fulcrum/commands.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::supervisor::cli {
namespace {

using config::KeyRule;

/// Comment behind a key in the file.
std::string CommentAt(const std::vector<std::string>& lines, int line) {
  if (line < 1 || static_cast<std::size_t>(line) > lines.size()) return {};
  const std::string& text = lines[static_cast<std::size_t>(line) - 1];
  const std::size_t at = text.find(" # ");
  return at == std::string::npos ? std::string() : text.substr(at + 3);
}

std::vector<std::string> LinesOf(const std::string& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

struct Entry {
  KeyRule rule;
  std::string about;
};

std::string Cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}

/// Prints one table per section; the section of a key is the part before its first dot.
void PrintTables(const std::vector<Entry>& entries) {
  const auto section_of = [](const std::string& path) { return path.substr(0, path.find_first_of(".[")); };
  std::vector<std::string> sections;
  for (const Entry& entry : entries) {
    const std::string section = entry.rule.path.find_first_of(".[") == std::string::npos && !entry.rule.valid.empty()
                                    ? std::string()
                                    : section_of(entry.rule.path);
    if (std::find(sections.begin(), sections.end(), section) == sections.end()) sections.push_back(section);
  }
  for (const std::string& section : sections) {
    std::cout << "\n## " << (section.empty() ? "Top" : section)
              << "\n\n| key | default | valid | |\n|---|---|---|---|\n";
    for (const Entry& entry : entries) {
      const KeyRule& rule = entry.rule;
      const bool top = rule.path.find_first_of(".[") == std::string::npos && !rule.valid.empty();
      if ((top ? std::string() : section_of(rule.path)) != section || rule.valid.empty()) continue;
      std::cout << "| `" << rule.path << "` | "
                << (!rule.standard           ? "must be given"
                    : rule.standard->empty() ? "–"
                                             : "`" + Cell(*rule.standard) + "`")
                << " | " << Cell(rule.valid) << " | " << Cell(entry.about) << " |\n";
    }
  }
}

}  // namespace

ExitCode Reference(const Words& words) {
  const bool help = std::find(words.begin(), words.end(), "--help") != words.end();
  if (help || words.size() < 2 || (words[0] != "cart" && words[0] != "scene")) {
    const char* usage =
        "usage: fulcrum reference cart|scene FILE...\n\n"
        "Prints every valid key of cart or scene files with default, valid values and the\n"
        "comments of the given files, as Markdown. Keys of list entries are printed only when\n"
        "a given file contains them, so give several files.\n\n"
        "Example:\n  fulcrum reference cart deploy/carts/simulated.yaml deploy/carts/touch.yaml\n";
    if (!help) throw InputError(std::string("reference needs \"cart\" or \"scene\" and at least one FILE\n") + usage);
    std::cout << usage;
    return ExitCode::kDone;
  }
  std::vector<Entry> entries;
  std::map<std::string, std::size_t> known;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::vector<std::string> lines = LinesOf(words[i]);
    const std::vector<KeyRule> rules = words[0] == "cart" ? config::CartRules(words[i]) : scene::SceneRules(words[i]);
    for (KeyRule rule : rules) {
      // All tools have the same keys.
      for (const char* tool : {"tool0", "tool1", "tool2", "tool3"}) {
        if (const std::size_t at = rule.path.find(tool); at != std::string::npos) rule.path.replace(at, 5, "toolN");
      }
      const auto [at, is_new] = known.emplace(rule.path, entries.size());
      if (is_new) entries.push_back({rule, {}});
      Entry& entry = entries[at->second];
      if (entry.about.empty()) entry.about = CommentAt(lines, rule.line);
    }
  }
  std::cout << (words[0] == "cart"
                    ? "# Cart reference\n\nA cart file describes the attached hardware and the settings of each node. "
                    : "# Scene reference\n\nA scene file describes anatomy, tools, material parameters and script. ")
            << "The reader of these files prints this page (`fulcrum reference " << words[0]
            << "`), from the same rules with which it checks them. Keys end in their unit; a value may give another "
               "unit of the same dimension.\n";
  PrintTables(entries);
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
