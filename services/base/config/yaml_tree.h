// Representation of a file in strict_yaml: a plain tree with line numbers, and for each map the keys that were read.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fulcrum::config::internal {

enum class NodeKind { kNull, kScalar, kList, kMap };

struct Node {
  NodeKind kind = NodeKind::kNull;
  int line = 0;      ///< From 1; 0 for a map that is absent in the file.
  std::string path;  ///< "physics.layers[2].k".
  std::string text;  ///< Value of a scalar.
  std::vector<Node*> items;
  std::vector<std::pair<std::string, Node*>> entries;
  const Node* replaced = nullptr;  ///< Value that the nearest base with one has in this place.

  /// Form of an entry that was read. Entries are in order of reading; of text, list and maps exactly one is used.
  enum class Form { kPlain, kQuoted, kFlow, kQuotedList, kMap, kMaps, kAbsent };
  struct Asked {
    std::string key;
    Form form = Form::kAbsent;
    std::string text;
    std::vector<std::string> list;
    std::vector<Node*> maps;
    std::string valid;                    ///< Description of the valid values.
    std::optional<std::string> standard;  ///< The default.
  };
  std::vector<Asked> asked;

  [[nodiscard]] Node* Find(std::string_view key) const;
};

/// Line numbers of the k-th base of a document are offset by k times this, which is more than any valid file has.
inline constexpr int kLinesPerFile = 1 << 21;

struct Document {
  std::string name;                ///< File, as given by the user.
  std::vector<std::string> bases;  ///< Its base files, the nearest first.
  std::vector<std::unique_ptr<Node>> nodes;
  Node* root = nullptr;

  Node* NewNode(NodeKind kind, int line, std::string path);
  /// Throws InputError "file:line: path: reason".
  [[noreturn]] void Fail(int line, std::string_view path, std::string_view reason) const;
};

/// Merges `document` over `base`: maps key by key, anything else replaces the value of the base. `base` is consumed.
void LayOver(std::unique_ptr<Document> base, Document* document);

/// Parses one YAML document whose root is a map. Throws InputError.
std::unique_ptr<Document> ParseDocument(std::string_view text, std::string_view name);

/// Reads a file of at most 1 MiB of text. Throws InputError.
std::string ReadTextFile(const std::string& file);

/// The entries that were read, as YAML.
std::string EmitAsked(const Node& root);

}  // namespace fulcrum::config::internal
