#include "tests/mutation/faults.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <initializer_list>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

namespace fulcrum::mutation {
namespace {

std::size_t LineOf(const std::string& text, std::size_t at) {
  return 1 + static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

std::string LineAt(const std::string& text, std::size_t at) {
  const std::size_t begin = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
  return text.substr(begin, text.find('\n', at) - begin);
}

class Finder {
 public:
  explicit Finder(std::string source) : source_(std::move(source)), code_(CodeOf(source_)) {}

  std::vector<Fault> All() {
    Numbers();
    // Binary operators stand between spaces (clang-format); `&&` of a template parameter and `->` do not match.
    Words(" - ", "sign", {" + "});
    Words(" + ", "sign", {" - "});
    Words(" < ", "border", {" <= "});
    Words(" <= ", "border", {" < "});
    Words(" > ", "border", {" >= "});
    Words(" >= ", "border", {" > "});
    Words(" == ", "condition", {" != "});
    Words(" != ", "condition", {" == "});
    Words(" && ", "condition", {" || "});
    Words(".x()", "axis", {".y()"});
    Words(".y()", "axis", {".x()"});
    Words(".z()", "axis", {".x()"});
    Words("std::max(", "limit", {"std::min("});
    Words("std::min(", "limit", {"std::max("});
    Statements();
    std::ranges::stable_sort(found_, {}, &Fault::begin);
    return std::move(found_);
  }

 private:
  void Add(std::size_t begin, std::size_t length, const char* kind, std::string text) {
    const std::string line = LineAt(code_, begin);
    if (line.find("static_assert") != std::string::npos || line.find("template <") != std::string::npos) return;
    found_.push_back({begin, begin + length, kind, std::move(text)});
  }

  void Words(std::string_view word, const char* kind, std::initializer_list<const char*> others) {
    for (std::size_t at = code_.find(word); at != std::string::npos; at = code_.find(word, at + 1)) {
      for (const char* other : others) Add(at, word.size(), kind, other);
    }
  }

  /// A fifth more, a fifth less, none; of a whole number above 2 in a line with constexpr, one more. Exponents are
  /// taken for units.
  void Numbers() {
    static const std::regex kNumber(R"((^|[^\w.'])((\d[\d']*\.\d*|\d[\d']*)([eE][-+]?\d+)?)(f?)(?![\w.]))");
    for (std::sregex_iterator match(code_.begin(), code_.end(), kNumber), end; match != end; ++match) {
      const std::size_t begin = static_cast<std::size_t>(match->position(2));
      const auto length = static_cast<std::size_t>(match->length(2));
      std::string digits = (*match)[2].str();
      std::erase(digits, '\'');
      double value = 0;
      std::from_chars(digits.data(), digits.data() + digits.size(), value);
      const bool real = digits.find_first_of(".eE") != std::string::npos;
      if (value == 0) continue;
      if (!real) {
        if (value > 2 && LineAt(code_, begin).find("constexpr") != std::string::npos) {
          Add(begin, length, "constant", std::to_string(static_cast<long long>(value) + 1));
        }
        continue;
      }
      for (const double factor : {1.2, 0.8, 0.0}) {
        std::ostringstream text;
        text.precision(9);
        text << factor * value;
        std::string changed = text.str();
        if (changed.find_first_of(".e") == std::string::npos) changed += ".0";
        Add(begin, length, factor == 0 ? "term" : "constant", changed);
      }
      if (match->length(4) > 0) Add(begin, length, "unit", digits.substr(0, digits.find_first_of("eE")) + "e0");
    }
  }

  /// A sum that is not added, a call that is not made.
  void Statements() {
    static const std::regex kSum(R"(\n *([\w.\[\]>()*-]+ [-+*]= [^;{}]*;))");
    static const std::regex kCall(R"(\n *((?:[\w]+(?:\.|->))?[A-Z]\w*\([^;{}]*\);)(?=\n))");
    for (const auto& [pattern, kind] : {std::pair(&kSum, "term"), std::pair(&kCall, "call")}) {
      for (std::sregex_iterator match(code_.begin(), code_.end(), *pattern), end; match != end; ++match) {
        // The line may be the end of a longer expression.
        const std::size_t before = code_.find_last_not_of(" \n", static_cast<std::size_t>(match->position()));
        if (before == std::string::npos || std::string_view(";{}):").find(code_[before]) == std::string_view::npos)
          continue;
        Add(static_cast<std::size_t>(match->position(1)), static_cast<std::size_t>(match->length(1)), kind, ";");
      }
    }
  }

  const std::string source_, code_;
  std::vector<Fault> found_;
};

std::string OneLine(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

}  // namespace

std::string CodeOf(const std::string& source) {
  std::string code = source;
  enum class In { kCode, kLine, kBlock, kString, kChar } in = In::kCode;
  bool directive = false;
  for (std::size_t i = 0; i < code.size(); ++i) {
    const char c = source[i], next = i + 1 < source.size() ? source[i + 1] : '\0';
    const bool line_starts = source.find_last_not_of(" \t", i == 0 ? 0 : i - 1) == std::string::npos || i == 0 ||
                             source[source.find_last_not_of(" \t", i - 1)] == '\n';
    if (in == In::kCode && c == '#' && line_starts) directive = true;
    if (c == '\n') {
      if (in == In::kLine) in = In::kCode;
      directive = directive && i > 0 && source[i - 1] == '\\';
      continue;
    }
    const bool hidden = in != In::kCode || directive;
    switch (in) {
      case In::kCode:
        // An apostrophe within a number separates digits.
        if (c == '/' && next == '/') in = In::kLine;
        if (c == '/' && next == '*') in = In::kBlock;
        if (c == '"') in = In::kString;
        if (c == '\'' && (i == 0 || std::isalnum(static_cast<unsigned char>(source[i - 1])) == 0)) in = In::kChar;
        if (in != In::kCode || hidden) code[i] = ' ';
        break;
      case In::kLine:
        code[i] = ' ';
        break;
      case In::kBlock:
        code[i] = ' ';
        if (c == '/' && source[i - 1] == '*') in = In::kCode;
        break;
      case In::kString:
      case In::kChar:
        code[i] = ' ';
        if (c == '\\') {
          if (next != '\n') code[i + 1] = ' ';
          ++i;
        } else if (c == (in == In::kString ? '"' : '\'')) {
          in = In::kCode;
        }
        break;
    }
  }
  return code;
}

std::vector<Fault> FaultsOf(const std::string& source) { return Finder(source).All(); }

std::string WithFault(const std::string& source, const Fault& fault) {
  return source.substr(0, fault.begin) + fault.text + source.substr(fault.end);
}

std::string Describe(const std::string& source, const Fault& fault) {
  const std::string old = OneLine(source.substr(fault.begin, fault.end - fault.begin));
  return std::to_string(LineOf(source, fault.begin)) + ' ' + fault.kind + ' ' + old + " -> " + fault.text;
}

}  // namespace fulcrum::mutation
