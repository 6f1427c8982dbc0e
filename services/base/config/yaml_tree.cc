#include "services/base/config/yaml_tree.h"

#include <yaml-cpp/emitter.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "services/base/core/error.h"
#include "services/base/core/utf8.h"

namespace fulcrum::config::internal {
namespace {

// The largest shipped file is 10 KB, so a file of this size is no configuration file.
constexpr std::size_t kMaxFileBytes = 1 << 20;
constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxKeyLength = 64;

class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(Document* document) : document_(document) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    RefuseAnchor(mark, anchor);
    RefuseKey(mark);
    Add(NodeKind::kNull, mark);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    document_->Fail(mark.line + 1, Path(), "aliases (*name) are not allowed; write the value out");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    RefuseAnchor(mark, anchor);
    RefuseTag(mark, tag);
    if (ExpectsKey()) {
      TakeKey(mark, value);
    } else {
      Add(NodeKind::kScalar, mark)->text = value;
    }
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    Open(NodeKind::kList, mark, tag, anchor);
  }
  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    Open(NodeKind::kMap, mark, tag, anchor);
  }
  void OnMapEnd() override { open_.pop_back(); }

 private:
  [[nodiscard]] bool ExpectsKey() const {
    return !open_.empty() && open_.back()->kind == NodeKind::kMap &&
           (open_.back()->entries.empty() || open_.back()->entries.back().second != nullptr);
  }

  void TakeKey(const YAML::Mark& mark, const std::string& key) {
    Node* map = open_.back();
    if (key.empty() || key.size() > kMaxKeyLength) {
      document_->Fail(mark.line + 1, Path(), "a key must have 1 to 64 characters");
    }
    if (const Node* first = map->Find(key)) {
      document_->Fail(mark.line + 1, map->path.empty() ? key : map->path + "." + key,
                      "is given twice (first in line " + std::to_string(first->line) + "); keep one");
    }
    map->entries.emplace_back(key, nullptr);
  }

  Node* Add(NodeKind kind, const YAML::Mark& mark) {
    Node* node = document_->NewNode(kind, mark.line + 1, "");
    if (open_.empty()) {
      document_->root = node;
    } else if (Node* parent = open_.back(); parent->kind == NodeKind::kList) {
      node->path = parent->path + "[" + std::to_string(parent->items.size()) + "]";
      parent->items.push_back(node);
    } else {
      const std::string& key = parent->entries.back().first;
      node->path = parent->path.empty() ? key : parent->path + "." + key;
      parent->entries.back().second = node;
    }
    return node;
  }

  void Open(NodeKind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
    RefuseAnchor(mark, anchor);
    RefuseTag(mark, tag);
    RefuseKey(mark);
    if (open_.size() >= kMaxDepth) {
      document_->Fail(mark.line + 1, "", "is nested deeper than 32 levels");
    }
    open_.push_back(Add(kind, mark));
  }

  void RefuseKey(const YAML::Mark& mark) const {
    if (ExpectsKey()) {
      document_->Fail(mark.line + 1, Path(), "a key must be a word");
    }
  }
  void RefuseAnchor(const YAML::Mark& mark, YAML::anchor_t anchor) const {
    if (anchor != YAML::NullAnchor) {
      document_->Fail(mark.line + 1, Path(), "anchors (&name) are not allowed; write the value out");
    }
  }
  void RefuseTag(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!") {  // "?" plain, "!" quoted.
      document_->Fail(mark.line + 1, Path(), "tags (!type) are not allowed; remove it");
    }
  }
  [[nodiscard]] std::string Path() const { return open_.empty() ? "" : open_.back()->path; }

  Document* document_;
  std::vector<Node*> open_;
};

void RefuseBinary(std::string_view text, std::string_view name) {
  int line = 1;
  std::size_t length = 0;
  for (std::size_t i = 0; i < text.size(); i += length) {
    const char c = text[i];
    line += c == '\n';
    const auto byte = static_cast<unsigned char>(c);
    const bool control = (byte < 0x20 && c != '\n' && c != '\r' && c != '\t') || byte == 0x7f;
    length = Utf8Length(text, i);
    if (control || length == 0) {
      throw InputError(std::string(name) + ":" + std::to_string(line) + ": is not a text file (" +
                       (control ? "control byte " : "not UTF-8 at byte ") + std::to_string(byte) +
                       "); give a YAML file");
    }
  }
}

void EmitMap(const Node& map, YAML::Emitter* out);

void EmitAskedKey(const Node::Asked& asked, YAML::Emitter* out) {
  *out << YAML::Key << asked.key << YAML::Value;
  switch (asked.form) {
    case Node::Form::kPlain:
      *out << YAML::Auto << asked.text;
      break;
    case Node::Form::kQuoted:
      *out << YAML::DoubleQuoted << asked.text;
      break;
    case Node::Form::kFlow:
    case Node::Form::kQuotedList:
      *out << YAML::Flow << YAML::BeginSeq;
      for (const std::string& item : asked.list) {
        if (asked.form == Node::Form::kQuotedList) {
          *out << YAML::DoubleQuoted;
        }
        *out << item;
      }
      *out << YAML::EndSeq;
      break;
    case Node::Form::kMap:
      EmitMap(*asked.maps.front(), out);
      break;
    case Node::Form::kMaps:
      *out << YAML::BeginSeq;
      for (const Node* map : asked.maps) {
        EmitMap(*map, out);
      }
      *out << YAML::EndSeq;
      break;
    case Node::Form::kAbsent:
      break;
  }
}

void EmitMap(const Node& map, YAML::Emitter* out) {
  *out << YAML::BeginMap;
  for (const Node::Asked& asked : map.asked) {
    if (asked.form != Node::Form::kAbsent) {
      EmitAskedKey(asked, out);
    }
  }
  *out << YAML::EndMap;
}

}  // namespace

Node* Node::Find(std::string_view key) const {
  const auto found =
      std::find_if(entries.begin(), entries.end(), [&](const auto& entry) { return entry.first == key; });
  return found == entries.end() ? nullptr : found->second;
}

Node* Document::NewNode(NodeKind kind, int line, std::string path) {
  nodes.push_back(std::make_unique<Node>());
  Node* node = nodes.back().get();
  node->kind = kind;
  node->line = line;
  node->path = std::move(path);
  return node;
}

void Document::Fail(int line, std::string_view path, std::string_view reason) const {
  const auto file = static_cast<std::size_t>(line / kLinesPerFile);
  std::string message = file == 0 ? name : bases[file - 1];
  if (line > 0) {
    message += ':';
    message += std::to_string(line % kLinesPerFile);
  }
  message += ": ";
  if (!path.empty()) {
    message += path;
    message += ": ";
  }
  throw InputError(message.append(reason));
}

namespace {

void Join(Node* base, const Node& over) {
  for (const auto& [key, node] : over.entries) {
    const auto known =
        std::find_if(base->entries.begin(), base->entries.end(),
                     [&, name = std::string_view(key)](const auto& entry) { return entry.first == name; });
    if (known == base->entries.end()) {
      base->entries.emplace_back(key, node);
    } else if (known->second->kind == NodeKind::kMap && node->kind == NodeKind::kMap) {
      Join(known->second, *node);
    } else {
      if (node->replaced == nullptr) node->replaced = known->second;
      known->second = node;
    }
  }
}

}  // namespace

void LayOver(std::unique_ptr<Document> base, Document* document) {
  const int shift = kLinesPerFile * static_cast<int>(document->bases.size() + 1);
  for (const auto& node : base->nodes) {
    node->line += shift;
  }
  Join(base->root, *document->root);
  document->root = base->root;
  document->bases.push_back(base->name);
  std::move(base->nodes.begin(), base->nodes.end(), std::back_inserter(document->nodes));
}

std::unique_ptr<Document> ParseDocument(std::string_view text, std::string_view name) {
  auto document = std::make_unique<Document>();
  document->name = name;
  if (text.size() > kMaxFileBytes) {
    document->Fail(0, "", "is larger than 1 MiB: not a configuration file");
  }
  RefuseBinary(text, name);
  std::istringstream stream{std::string(text)};
  try {
    YAML::Parser parser(stream);
    TreeBuilder builder(document.get());
    if (!parser.HandleNextDocument(builder) || document->root->kind == NodeKind::kNull) {
      document->Fail(0, "", "is empty; write at least one `key: value`");
    }
    Document rest;  // A second document would be ignored in silence.
    rest.name = name;
    TreeBuilder rest_builder(&rest);
    if (parser.HandleNextDocument(rest_builder)) {
      document->Fail(rest.root ? rest.root->line : 0, "", "has a second document (`---`); keep one");
    }
  } catch (const YAML::Exception& e) {
    document->Fail(e.mark.is_null() ? 0 : e.mark.line + 1, "", "YAML syntax: " + e.msg);
  }
  if (document->root->kind != NodeKind::kMap) {
    document->Fail(document->root->line, "", "must be a map of `key: value` lines");
  }
  return document;
}

std::string ReadTextFile(const std::string& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) {
    throw InputError(file + ": no such file; check the path");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(file + ": is not a regular file; give a YAML file");
  }
  if (const auto size = std::filesystem::file_size(file, error); error || size > kMaxFileBytes) {
    throw InputError(file + ": is larger than 1 MiB: not a configuration file");
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (!stream.is_open() || stream.bad()) {
    throw InputError(file + ": cannot be read; check its permissions");
  }
  return text;
}

std::string EmitAsked(const Node& root) {
  YAML::Emitter out;
  EmitMap(root, &out);
  return std::string(out.c_str()) + "\n";
}

}  // namespace fulcrum::config::internal
