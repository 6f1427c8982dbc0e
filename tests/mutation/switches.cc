#include "tests/mutation/switches.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <regex>
#include <string_view>
#include <utility>

namespace fulcrum::mutation {
namespace {

/// A text in place of [begin, end) of the source.
struct Edit {
  std::size_t begin = 0, end = 0;
  std::string text;
};

/// [begin, end) of the operands and operators of the chain of && that an operator at `at` belongs to. Empty where no
/// end is found.
std::pair<std::size_t, std::size_t> ChainAround(const std::string& code, std::size_t at) {
  const auto is = [&](std::size_t i, std::string_view word) { return code.compare(i, word.size(), word) == 0; };
  int depth = 0;
  std::size_t begin = at;
  for (; begin > 0; --begin) {
    const char c = code[begin - 1];
    if (c == ')' || c == ']' || c == '}') ++depth;
    if ((c == '(' || c == '[' || c == '{') && depth-- == 0) break;
    if (depth > 0) continue;
    if (c == ',' || c == ';' || c == '?') break;
    if (c == ':' && (begin < 2 || code[begin - 2] != ':') && code[begin] != ':') break;
    if (begin >= 2 && is(begin - 2, "||")) break;
    if (c == '=' && code[begin - 2] == ' ' && (code[begin] == ' ' || code[begin] == '\n')) break;
    if (begin >= 7 && is(begin - 7, "return ")) break;
  }
  depth = 0;
  std::size_t end = at;
  for (; end < code.size(); ++end) {
    const char c = code[end];
    if (c == '(' || c == '[' || c == '{') ++depth;
    if ((c == ')' || c == ']' || c == '}') && depth-- == 0) break;
    if (depth > 0) continue;
    if (c == ',' || c == ';' || c == '?') break;
    if (c == ':' && code[end + 1] != ':' && code[end - 1] != ':') break;
    if (is(end, "||")) break;
  }
  return {begin, end};
}

std::string_view OperatorOf(std::string_view text) {
  text.remove_prefix(1);
  text.remove_suffix(1);
  return text;
}

/// The edits of a fault that neither encloses nor shares its place with another.
std::vector<Edit> EditsOf(const std::string& source, const std::string& code, const Fault& fault,
                          const std::string& number) {
  const std::string old = source.substr(fault.begin, fault.end - fault.begin);
  const std::string kind = fault.kind, on = "::fulcrum::mutation::Faulty(" + number + ')';
  if (kind == "sign" || kind == "border" || (kind == "condition" && old != " && ")) {
    const std::string_view word = OperatorOf(old);
    const char name = word == "<=" ? 'l' : word == ">=" ? 'g' : word[0];
    return {{fault.end, fault.end, "::fulcrum::mutation::Place<'" + std::string(1, name) + "'>{" + number + '}' + old}};
  }
  if (kind == "condition") {
    const auto [begin, end] = ChainAround(code, fault.begin);
    std::string wrong = WithFault(source, fault).substr(begin, end - begin);  // " || " is as long as " && "
    // The lines below keep their numbers; a comment would hide the rest.
    if (wrong.find("//") != std::string::npos) return {};
    std::ranges::replace(wrong, '\n', ' ');
    return {{begin, begin, '(' + on + " ? (" + wrong + ") : ("}, {end, end, "))"}};
  }
  if (kind == "axis") {
    const auto index = [](std::string_view word) { return std::string(1, static_cast<char>('0' + word[1] - 'x')); };
    return {{fault.begin, fault.end, '[' + on + " ? " + index(fault.text) + " : " + index(old) + ']'}};
  }
  if (kind == "limit") {
    const bool max = old.find("max") != std::string::npos;
    return {
        {fault.begin, fault.end, std::string("::fulcrum::mutation::") + (max ? "Max" : "Min") + '(' + number + ", "}};
  }
  if (fault.text == ";") return {{fault.begin, fault.begin, "{ if (!" + on + ") { "}, {fault.end, fault.end, " } }"}};
  return {};
}

/// Whether a fault replaces a number.
bool IsNumber(const std::string& source, const Fault& fault) {
  return std::isdigit(static_cast<unsigned char>(source[fault.begin])) != 0;
}

/// `constexpr` as `const` in the definitions of numbers that the switches change, and in those that use one of these.
void MakeVariables(std::string* source, const std::vector<Switch>& switches) {
  static const std::regex kDefinition(R"(\bconstexpr ([\w:]+(?:<[^;={}()]*>)?) (k\w+)(?:\[\w*\])?(?: = |\{)[^;]*;)");
  const std::string code = CodeOf(*source);
  std::vector<std::pair<std::size_t, std::string>> definitions;  // Place of `constexpr`, whole text.
  std::vector<std::string> names, changed;
  std::vector<bool> variable;
  for (std::sregex_iterator match(code.begin(), code.end(), kDefinition), end; match != end; ++match) {
    const auto begin = static_cast<std::size_t>(match->position()), size = static_cast<std::size_t>(match->length());
    definitions.emplace_back(begin, match->str());
    names.push_back((*match)[2].str());
    variable.push_back(std::ranges::any_of(
        switches, [&](const Switch& s) { return s.fault.begin >= begin && s.fault.begin < begin + size; }));
    if (variable.back()) changed.push_back(names.back());
  }
  for (std::size_t c = 0; c < changed.size(); ++c) {
    const std::regex use("\\b" + changed[c] + "\\b");
    for (std::size_t i = 0; i < definitions.size(); ++i) {
      if (variable[i] || !std::regex_search(definitions[i].second, use)) continue;
      variable[i] = true;
      changed.push_back(names[i]);
    }
  }
  for (std::size_t i = 0; i < definitions.size(); ++i) {
    if (variable[i]) source->replace(definitions[i].first, std::strlen("constexpr"), "const    ");
  }
  // What they assert they no longer know.
  static const std::regex kAssert(R"(\bstatic_assert\([^;]*;)");
  for (std::sregex_iterator match(code.begin(), code.end(), kAssert), end; match != end; ++match) {
    for (auto i = static_cast<std::size_t>(match->position()), n = i + static_cast<std::size_t>(match->length()); i < n;
         ++i) {
      if ((*source)[i] != '\n') (*source)[i] = ' ';
    }
  }
}

}  // namespace

std::string WithSwitches(const std::string& source, const std::vector<Switch>& switches, const std::string& path) {
  std::string text = source;
  MakeVariables(&text, switches);
  const std::string code = CodeOf(text);
  std::vector<Edit> edits;
  for (std::size_t i = 0; i < switches.size(); ++i) {
    const Fault& fault = switches[i].fault;
    if (fault.text != ";" && IsNumber(text, fault)) {
      // All that is drawn for this number in one expression, with its suffix.
      std::size_t end = fault.end;
      while (std::isalpha(static_cast<unsigned char>(text[end])) != 0) ++end;
      const std::string suffix = text.substr(fault.end, end - fault.end);
      const std::string chosen =
          "::fulcrum::mutation::Faulty(" + std::to_string(switches[i].number) + ") ? " + fault.text + suffix + " : ";
      const auto same =
          std::ranges::find_if(edits, [&](const Edit& e) { return e.begin == fault.begin && e.end == end; });
      if (same != edits.end()) {
        same->text.insert(1, chosen);
      } else {
        edits.push_back({fault.begin, end, '(' + chosen + text.substr(fault.begin, end - fault.begin) + ')'});
      }
      continue;
    }
    for (Edit& edit : EditsOf(text, code, fault, std::to_string(switches[i].number))) edits.push_back(std::move(edit));
  }
  // From the back, so that places stay the same; of two at one place first the one that replaces something.
  std::ranges::stable_sort(edits, [](const Edit& a, const Edit& b) {
    return a.begin != b.begin ? a.begin > b.begin : a.end - a.begin > b.end - b.begin;
  });
  for (const Edit& edit : edits) text.replace(edit.begin, edit.end - edit.begin, edit.text);
  return "#include \"tests/mutation/switch.h\"\n#line 1 \"" + path + "\"\n" + text;
}

}  // namespace fulcrum::mutation
