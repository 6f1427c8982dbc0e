// Strict YAML: every key is known, used exactly once and within its range, or the file is refused with one clear line.
//
//   StrictYaml file = StrictYaml::FromFile("scene.yaml");
//   StrictMap root = file.root();
//   p.mode = root.Choice("mode", p.mode, {{"paper", Mode::kPaper}});
//   p.thickness_m = root.NumberSi("thickness_mm", p.thickness_m, Range::Between(0.05, 5));  // default [m], range [mm]
//   StrictMap tool = root.MapOrDefaults("tool");
//   file.Finish();                     // Refuses every key that was not read.
//   std::string effective = file.Effective();
//
// A key that stands for a physical quantity ends in its unit (units.h). Its value is a plain number in that unit or a
// quantity such as "300 um" of the same dimension. Refused with InputError "file:line: key.path: ...": missing, huge
// (> 1 MiB), binary, not UTF-8 or empty files, YAML syntax errors, duplicate keys, anchors, aliases and tags, more than
// one document, nesting deeper than 32, unknown keys (the nearest known key is suggested), missing keys, wrong types,
// wrong units, values that are not finite or out of range. Reading one key twice is a bug of the caller:
// std::logic_error.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/core/types.h"

namespace fulcrum::config {

/// Closed or half-open interval of valid values, in the unit of the key.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false;

  static Range Any() { return {}; }
  static Range Between(double lo, double hi) { return {lo, hi, false}; }
  static Range AtLeast(double lo) { return {lo, std::numeric_limits<double>::infinity(), false}; }
  static Range Positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
  /// The half-open interval (lo, hi].
  static Range Above(double lo, double hi) { return {lo, hi, true}; }
  [[nodiscard]] bool Contains(double x) const { return (min_open ? x > min : x >= min) && x <= max; }
};

namespace internal {
struct Node;
struct Document;
}  // namespace internal

/// One map of the file. A light handle, valid while its StrictYaml exists.
class StrictMap {
 public:
  /// True when the file has this key. Does not count as use.
  [[nodiscard]] bool Has(std::string_view key) const;

  /// Numbers, returned in the unit of the key. Without default the key is required.
  double Number(std::string_view key, const Range& range);
  double Number(std::string_view key, double default_value, const Range& range);
  /// Numbers, returned in SI (temperatures in degrees Celsius). The default is in SI, the range in the key's unit.
  double NumberSi(std::string_view key, const Range& range);
  double NumberSi(std::string_view key, double default_si, const Range& range);

  std::int64_t Integer(std::string_view key, std::int64_t min, std::int64_t max);
  std::int64_t Integer(std::string_view key, std::int64_t default_value, std::int64_t min, std::int64_t max);

  bool Flag(std::string_view key);
  bool Flag(std::string_view key, bool default_value);

  /// Text of 1 … max_length bytes, without control characters. A default may be empty.
  std::string Text(std::string_view key, std::size_t max_length = 255);
  std::string TextOr(std::string_view key, std::string_view default_value, std::size_t max_length = 255);

  /// Value of one of a few words.
  template <class E>
  using Choices = std::vector<std::pair<std::string_view, E>>;
  template <class E>
  E Choice(std::string_view key, const Choices<E>& choices) {
    return choices[ChoiceIndex(key, nullptr, Words(choices))].second;
  }
  template <class E>
  E Choice(std::string_view key, const E& default_value, const Choices<E>& choices) {
    for (std::size_t i = 0; i < choices.size(); ++i) {
      if (choices[i].second == default_value) {
        return choices[ChoiceIndex(key, &i, Words(choices))].second;
      }
    }
    throw std::logic_error("default of '" + std::string(key) + "' is not among its choices");
  }

  /// List of numbers in the key's unit (…Si: in SI), each within range.
  std::vector<double> Numbers(std::string_view key, std::size_t min_count, std::size_t max_count, const Range& range);
  std::vector<double> NumbersSi(std::string_view key, std::size_t min_count, std::size_t max_count, const Range& range);
  std::vector<double> NumbersSi(std::string_view key, const std::vector<double>& default_si, std::size_t min_count,
                                std::size_t max_count, const Range& range);
  /// Three numbers, as a vector in SI.
  Vec3f Vector3Si(std::string_view key, const Range& range);
  Vec3f Vector3Si(std::string_view key, const Vec3f& default_si, const Range& range);
  /// List of texts; absent: empty when min_count is 0.
  std::vector<std::string> Texts(std::string_view key, std::size_t min_count, std::size_t max_count);

  /// Sub-map that is required.
  StrictMap Map(std::string_view key);
  /// Sub-map whose keys all take their defaults when it is absent.
  StrictMap MapOrDefaults(std::string_view key);
  /// Sub-map that may be absent.
  std::optional<StrictMap> OptionalMap(std::string_view key);
  /// List of maps; absent: empty when min_count is 0.
  std::vector<StrictMap> Maps(std::string_view key, std::size_t min_count, std::size_t max_count);
  /// Names of the keys of this map, in file order: for maps whose keys are names chosen in the file. Does not count as
  /// use: each key must still be read.
  [[nodiscard]] std::vector<std::string> Keys() const;

  /// Of two keys that exclude each other, omits the one that comes from the farther base, so that a file can replace
  /// what its base chose. Without effect if both are in one file.
  void KeepNearer(std::string_view one, std::string_view other);
  /// True if a word of the file replaces another one of its base.
  [[nodiscard]] bool IsChanged(std::string_view key) const;
  /// Omits a key, or those keys of a map, that come from a farther base than `than`: what a base says of something that
  /// the file has replaced.
  void OmitFarther(std::string_view key, std::string_view than);
  /// A number that is given elsewhere, in the key's unit, in place of the one that was read: Effective() has it.
  void Restate(std::string_view key, double value);

  /// For rules that span several keys: throws InputError at this key's line: "file:line: path: `reason`".
  [[noreturn]] void Fail(std::string_view key, std::string_view reason) const;

 private:
  friend class StrictYaml;
  StrictMap(internal::Document* document, internal::Node* node) : document_(document), node_(node) {}

  template <class E>
  static std::vector<std::string_view> Words(const Choices<E>& choices) {
    std::vector<std::string_view> words;
    for (const auto& choice : choices) {
      words.push_back(choice.first);
    }
    return words;
  }

  internal::Node* Use(std::string_view key);
  internal::Node* Require(std::string_view key, std::string_view what);
  /// Records the rule of the key that was read last.
  void Rule(std::string valid, std::optional<std::string> standard);
  double ReadNumber(std::string_view key, const double* default_value, const Range& range);
  std::optional<std::vector<double>> ReadNumbers(std::string_view key, std::size_t min_count, std::size_t max_count,
                                                 const Range& range);
  std::int64_t ReadInteger(std::string_view key, const std::int64_t* default_value, std::int64_t min, std::int64_t max);
  bool ReadFlag(std::string_view key, const bool* default_value);
  std::string ReadText(std::string_view key, const std::string_view* default_value, std::size_t max_length);
  std::size_t ChoiceIndex(std::string_view key, const std::size_t* default_index,
                          const std::vector<std::string_view>& words);

  internal::Document* document_;
  internal::Node* node_;
};

/// A key that was read, and its valid values.
struct KeyRule {
  std::string path;                     ///< "handles.tool0.simulated.noise_mV"; of a list's maps "structures[].kind".
  int line = 0;                         ///< Line in the file; 0: the file does not contain the key.
  std::optional<std::string> standard;  ///< Default value; none: the key is required, or is a map.
  std::string valid;                    ///< Description of the valid values; empty for maps.
};

/// One configuration file.
class StrictYaml {
 public:
  /// Reads and parses. Throws InputError.
  static StrictYaml FromFile(const std::filesystem::path& file);
  /// As FromFile, for text in memory; `name` stands for the file in messages.
  static StrictYaml FromText(std::string_view text, std::string_view name);
  /// As FromFile, for a file that may be based on others: its key `base` names one, relative to its folder, which may
  /// have a base as well. Maps are merged key by key, anything else, lists included, replaces the value of the base;
  /// `own` keys are never taken from a base.
  /// @param library a base may also be the name, without extension, of a file there.
  /// @param text replaces the content of `file` when it is not empty.
  static StrictYaml FromFileOnBases(const std::filesystem::path& file, const std::vector<std::string_view>& own,
                                    const std::filesystem::path& library = {}, std::string_view text = {});
  ~StrictYaml();
  StrictYaml(StrictYaml&&) noexcept;
  StrictYaml& operator=(StrictYaml&&) noexcept;

  [[nodiscard]] StrictMap root();
  /// The files that were read: the file itself, then its bases.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;
  /// Refuses keys that were not read. Call when everything has been read.
  void Finish() const;
  /// The values that were read, defaults included, as YAML in the order of reading. Reading it gives the same values.
  [[nodiscard]] std::string Effective() const;
  /// Every key that was read, in the order of reading; of the maps of a list the first stands for all.
  [[nodiscard]] std::vector<KeyRule> Rules() const;
  /// Every value of the file that is no map or list, as text: for a search of what it names.
  [[nodiscard]] std::vector<std::string> Values() const;

 private:
  explicit StrictYaml(std::unique_ptr<internal::Document> document);
  std::unique_ptr<internal::Document> document_;
};

}  // namespace fulcrum::config
