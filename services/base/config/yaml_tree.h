// What strict_yaml keeps of a file: a plain tree with line numbers, and beside each map what was asked of it.
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
  int line = 0;      ///< From 1; 0 for a map that stands for an absent one.
  std::string path;  ///< "physics.layers[2].k".
  std::string text;  ///< Of a scalar.
  std::vector<Node*> items;
  std::vector<std::pair<std::string, Node*>> entries;

  /// What was read, in order of asking: exactly one of text, flow, map, maps is used, as `form` says.
  enum class Form { kPlain, kQuoted, kFlow, kQuotedList, kMap, kMaps, kAbsent };
  struct Asked {
    std::string key;
    Form form = Form::kAbsent;
    std::string text;
    std::vector<std::string> list;
    std::vector<Node*> maps;
    std::string valid;                    ///< What would be, in words.
    std::optional<std::string> standard;  ///< The default.
  };
  std::vector<Asked> asked;

  [[nodiscard]] Node* Find(std::string_view key) const;
};

/// Lines of the k-th file that a document was laid over count from k times this: more than any file of ours has.
inline constexpr int kLinesPerFile = 1 << 21;

struct Document {
  std::string name;                ///< File, as given by the user.
  std::vector<std::string> bases;  ///< The files beneath it, the nearest first.
  std::vector<std::unique_ptr<Node>> nodes;
  Node* root = nullptr;

  Node* NewNode(NodeKind kind, int line, std::string path);
  /// Throws InputError "file:line: path: reason".
  [[noreturn]] void Fail(int line, std::string_view path, std::string_view reason) const;
};

/// Lays `document` over `base`: maps join key by key, anything else replaces what is there. `base` is used up.
void LayOver(std::unique_ptr<Document> base, Document* document);

/// Parses one YAML document whose root is a map. Throws InputError.
std::unique_ptr<Document> ParseDocument(std::string_view text, std::string_view name);

/// Reads a file of at most 1 MiB of text. Throws InputError.
std::string ReadTextFile(const std::string& file);

/// The tree of what was asked, as YAML.
std::string EmitAsked(const Node& root);

}  // namespace fulcrum::config::internal
