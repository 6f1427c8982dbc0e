#include "services/base/config/strict_yaml.h"

#include <algorithm>
#include <string>

#include "services/base/config/key_usage.h"
#include "services/base/config/value_text.h"
#include "services/base/config/yaml_tree.h"

namespace fulcrum::config {

using internal::Document;
using internal::KindName;
using internal::Node;
using internal::NodeKind;
using internal::Quoted;

StrictYaml StrictYaml::FromFile(const std::filesystem::path& file) {
  return FromText(internal::ReadTextFile(file.string()), file.string());
}

StrictYaml StrictYaml::FromText(std::string_view text, std::string_view name) {
  return StrictYaml(internal::ParseDocument(text, name));
}

StrictYaml StrictYaml::FromFileOnBases(const std::filesystem::path& file, const std::vector<std::string_view>& own,
                                       const std::filesystem::path& library, std::string_view text) {
  constexpr std::size_t kMostBases = 8;  // More than eight are taken for a cycle.
  constexpr std::string_view kBase = "base";
  const auto parse = [](const std::filesystem::path& at) {
    return internal::ParseDocument(internal::ReadTextFile(at.string()), at.string());
  };
  const auto take = [&](Document* document, std::string_view key) -> const Node* {
    auto& entries = document->root->entries;
    const auto at = std::find_if(entries.begin(), entries.end(), [&](const auto& entry) { return entry.first == key; });
    const Node* node = at == entries.end() ? nullptr : at->second;
    if (node != nullptr) entries.erase(at);
    return node;
  };
  auto document = text.empty() ? parse(file) : internal::ParseDocument(text, file.string() + " with --set applied");
  std::filesystem::path folder = file.parent_path();
  const Node* next = take(document.get(), kBase);
  while (next != nullptr) {
    if (next->kind != NodeKind::kScalar || next->text.empty()) {
      document->Fail(next->line, kBase, std::string("expected the name of a file, found ") + KindName(*next));
    }
    if (document->bases.size() == kMostBases) {
      document->Fail(next->line, kBase, "more than 8 files are based on one another: is there a cycle?");
    }
    std::filesystem::path at = (folder / next->text).lexically_normal();
    std::error_code error;  // A name that is too long is no file either.
    if (!std::filesystem::is_regular_file(at, error)) {
      const bool may_be_name = !library.empty() && next->text.find('/') == std::string::npos;
      const std::filesystem::path named = library / (next->text + ".yaml");
      if (!may_be_name || !std::filesystem::is_regular_file(named, error)) {
        document->Fail(next->line, kBase,
                       Quoted(next->text) + " is not at " + at.string() + "; give a file beside this one" +
                           (library.empty() ? "" : ", or the name of one in " + library.string()));
      }
      at = std::filesystem::canonical(named);
    }
    auto below = parse(at);
    const Node* after = take(below.get(), kBase);
    for (const std::string_view key : own) (void)take(below.get(), key);
    folder = at.parent_path();
    internal::LayOver(std::move(below), document.get());
    next = after;
  }
  return StrictYaml(std::move(document));
}

std::vector<std::filesystem::path> StrictYaml::files() const {
  std::vector<std::filesystem::path> all{document_->name};
  all.insert(all.end(), document_->bases.begin(), document_->bases.end());
  return all;
}

StrictYaml::StrictYaml(std::unique_ptr<Document> document) : document_(std::move(document)) {}
StrictYaml::~StrictYaml() = default;
StrictYaml::StrictYaml(StrictYaml&&) noexcept = default;
StrictYaml& StrictYaml::operator=(StrictYaml&&) noexcept = default;

StrictMap StrictYaml::root() { return {document_.get(), document_->root}; }

void StrictYaml::Finish() const { internal::CheckAllUsed(*document_, *document_->root); }

std::string StrictYaml::Effective() const { return internal::EmitAsked(*document_->root); }

std::vector<KeyRule> StrictYaml::Rules() const { return internal::RulesOf(*document_->root); }

std::vector<std::string> StrictYaml::Values() const {
  std::vector<std::string> values;
  for (const auto& node : document_->nodes) {
    if (node->kind == NodeKind::kScalar) values.push_back(node->text);
  }
  return values;
}

}  // namespace fulcrum::config
