#include "services/base/config/strict_yaml.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>

#include "services/base/config/units.h"

namespace fulcrum::config {
namespace {

enum class Mode { kPaper, kAccurate };

/// Values that one schema reads, for the tests below.
struct Example {
  double thickness_m = 3e-4f;
  double stiffness = 0.8;
  std::int64_t iterations = 3;
  bool enabled = true;
  Mode mode = Mode::kPaper;
  std::string name = "membrane";
  Vec3f tip_m = Vec3f(0, 0, 0.2f);
  double temperature_C = 37;
  double layer_k = 0.1;
  std::vector<double> tools_s;
};

Example Read(StrictYaml* file) {
  Example e;
  StrictMap root = file->root();
  e.thickness_m = root.NumberSi("thickness_mm", e.thickness_m, Range::Between(0.05, 5));
  e.stiffness = root.Number("stiffness", e.stiffness, Range::Above(0, 1));
  e.iterations = root.Integer("iterations", e.iterations, 1, 100);
  e.enabled = root.Flag("enabled", e.enabled);
  e.mode = root.Choice<Mode>("mode", e.mode, {{"paper", Mode::kPaper}, {"accurate", Mode::kAccurate}});
  e.name = root.TextOr("name", e.name, 16);
  e.tip_m = root.Vector3Si("tip_mm", e.tip_m, Range::Between(-1000, 1000));
  e.temperature_C = root.Number("temperature_C", e.temperature_C, Range::Between(0, 60));
  StrictMap layer = root.MapOrDefaults("layer");
  e.layer_k = layer.Number("k", e.layer_k, Range::Between(0, 1));
  for (StrictMap& tool : root.Maps("tools", 0, 2)) {
    e.tools_s.push_back(tool.NumberSi("time_ms", Range::AtLeast(0)));
  }
  file->Finish();
  return e;
}

Example ReadText(std::string_view text) {
  StrictYaml file = StrictYaml::FromText(text, "example.yaml");
  return Read(&file);
}

std::string Refusal(const std::function<void()>& body) {
  try {
    body();
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(StrictYaml, TellsTheRulesOfEveryKeyThatWasAskedFor) {
  StrictYaml file = StrictYaml::FromText("# how it is\nstiffness: 0.5\n", "rules.yaml");
  Read(&file);
  const std::vector<KeyRule> rules = file.Rules();
  const auto rule = [&](const std::string& path) {
    const auto found = std::find_if(rules.begin(), rules.end(), [&](const KeyRule& r) { return r.path == path; });
    return found == rules.end() ? KeyRule{"none", 0, std::nullopt, ""} : *found;
  };
  EXPECT_EQ(rule("stiffness").line, 2);
  EXPECT_EQ(rule("stiffness").standard, "0.8") << "the default, independent of the file";
  EXPECT_EQ(rule("stiffness").valid, "above 0 up to 1");
  EXPECT_EQ(rule("thickness_mm").line, 0);
  EXPECT_EQ(rule("thickness_mm").standard, "0.3");
  EXPECT_EQ(rule("thickness_mm").valid, "0.05 to 5 mm");
  EXPECT_EQ(rule("mode").valid, "paper, accurate");
  EXPECT_EQ(rule("tip_mm").standard, "[0, 0, 200]");
  EXPECT_EQ(rule("iterations").valid, "an integer from 1 to 100");
}

TEST(StrictYaml, ReadsValuesInTheirUnits) {
  const Example e = ReadText(
      "thickness_mm: 300 um\nstiffness: 5e-1\niterations: 7\nenabled: false\nmode: accurate\nname: sheet\n"
      "tip_mm: [1, 2 cm, -0.003 m]\ntemperature_C: 40 °C\nlayer: {k: 0.25}\ntools:\n  - time_ms: 2 s\n  - time_ms: "
      "5\n");
  EXPECT_NEAR(e.thickness_m, 3e-4, 1e-12);
  EXPECT_EQ(e.stiffness, 0.5);
  EXPECT_EQ(e.iterations, 7);
  EXPECT_FALSE(e.enabled);
  EXPECT_EQ(e.mode, Mode::kAccurate);
  EXPECT_EQ(e.name, "sheet");
  EXPECT_TRUE(e.tip_m.isApprox(Vec3f(0.001f, 0.02f, -0.003f)));
  EXPECT_EQ(e.temperature_C, 40);
  EXPECT_EQ(e.layer_k, 0.25);
  ASSERT_EQ(e.tools_s.size(), 2u);
  EXPECT_EQ(e.tools_s[0], 2);
  EXPECT_NEAR(e.tools_s[1], 0.005, 1e-15);
}

TEST(StrictYaml, AbsentKeysKeepTheirDefaultsExactly) {
  const Example e = ReadText("iterations: 3\n");
  EXPECT_EQ(e.thickness_m, static_cast<double>(3e-4f));
  EXPECT_EQ(e.tip_m, Vec3f(0, 0, 0.2f));
  EXPECT_EQ(e.layer_k, 0.1);
  EXPECT_TRUE(e.tools_s.empty());
}

TEST(StrictYaml, EffectiveConfigurationShowsDefaultsAndReadsBackToItself) {
  StrictYaml file = StrictYaml::FromText("thickness_mm: 0.25\nname: \"yes: 1\"\ntools: [{time_ms: 1.5}]\n", "a");
  const Example first = Read(&file);
  const std::string effective = file.Effective();
  EXPECT_NE(effective.find("thickness_mm: 0.25"), std::string::npos) << effective;
  EXPECT_NE(effective.find("tip_mm: [0, 0, 200]"), std::string::npos) << effective;
  EXPECT_NE(effective.find("k: 0.1"), std::string::npos) << effective;
  StrictYaml again = StrictYaml::FromText(effective, "b");
  const Example second = Read(&again);
  EXPECT_EQ(again.Effective(), effective);
  EXPECT_EQ(first.thickness_m, second.thickness_m);
  EXPECT_EQ(first.name, second.name);
  EXPECT_EQ(first.tools_s, second.tools_s);
}

struct BadCase {
  const char* rule;
  const char* text;
  std::vector<const char*> said;  ///< Parts that the message must contain.
};

class RefusedText : public ::testing::TestWithParam<BadCase> {};

TEST_P(RefusedText, SaysPlaceKeyValueAndRange) {
  const std::string said = Refusal([] { ReadText(GetParam().text); });
  EXPECT_NE(said.find("example.yaml"), std::string::npos) << said;
  for (const char* part : GetParam().said) {
    EXPECT_NE(said.find(part), std::string::npos) << said;
  }
}

const BadCase kBadCases[] = {
    {"UnknownKey", "iteration: 3", {":1: iteration: unknown key", "did you mean 'iterations'?"}},
    {"UnknownKeyInMap", "\nlayer:\n  kk: 1\n", {":3: layer.kk: unknown key", "'k'"}},
    {"UnknownKeyInList", "tools:\n- {time_ms: 1}\n- {time_ms: 1, tme: 1}", {":3: tools[1].tme: unknown key"}},
    {"KeyTwice", "iterations: 3\niterations: 4", {":2: iterations: is given twice (first in line 1)"}},
    {"BelowRange", "\nthickness_mm: 0.01", {":2: thickness_mm: '0.01' is out of range; valid: 0.05 to 5 mm"}},
    {"OpenLowerEnd", "stiffness: 0", {"stiffness: '0' is out of range; valid: above 0 up to 1"}},
    {"AboveRangeInOtherUnit", "thickness_mm: 6000 um", {"'6000 um' is out of range; valid: 0.05 to 5 mm"}},
    {"WrongDimension", "thickness_mm: 0.3 s", {"'0.3 s' has the wrong unit: this is a length in mm; valid: 0.05 to 5"}},
    {"WrongTemperature", "temperature_C: 310 K", {"'310 K' has the wrong unit: this is a temperature in C"}},
    {"UnitOnPlainNumber", "stiffness: 0.5 mm", {"'0.5 mm' has a unit, but this is a plain number"}},
    {"UnknownUnit", "thickness_mm: 1 furlong", {"'1 furlong': unknown unit"}},
    {"NotANumber", "thickness_mm: thick", {"'thick' is not a finite number"}},
    {"Nan", "thickness_mm: nan", {"'nan' is not a finite number"}},
    {"Infinite", "thickness_mm: .inf", {"'.inf' is not a finite number"}},
    {"TooLargeForDouble", "thickness_mm: 1e999", {"'1e999' is not a finite number"}},
    {"ListForNumber", "thickness_mm: [1]", {"expected a number, found a list"}},
    {"NoValue", "thickness_mm:", {"thickness_mm: has no value"}},
    {"FractionForInteger", "iterations: 3.5", {"'3.5' is not valid; valid: an integer from 1 to 100"}},
    {"IntegerOutOfRange", "iterations: 101", {"'101' is not valid; valid: an integer from 1 to 100"}},
    {"YesForFlag", "enabled: yes", {"'yes' is not valid; valid: true, false"}},
    {"UnknownChoice", "mode: fast", {"'fast' is not valid; valid: paper, accurate"}},
    {"TextTooLong", "name: aaaaaaaaaaaaaaaaaaaaaaa", {"valid: a text of 1 to 16 bytes"}},
    {"TextEmpty", "name: ''", {"valid: a text of 1 to 16 bytes"}},
    {"MapForText", "name: {a: b}", {"a map is not valid"}},
    {"VectorTooShort", "tip_mm: [1, 2]", {"expected a list of 3 numbers, found a list of 2"}},
    {"VectorItemOutOfRange", "tip_mm: [1, 2, 3 m]", {"tip_mm[2]: '3 m' is out of range"}},
    {"ScalarForMap", "layer: 1", {"layer: expected a map, found a single value"}},
    {"ScalarInListOfMaps", "tools: [1]", {"tools[0]: expected a map"}},
    {"TooManyMaps", "tools: [{time_ms: 1},{time_ms: 1},{time_ms: 1}]", {"expected a list of 0 to 2 maps, found 3"}},
    {"RequiredKeyMissing", "tools:\n- {}\n", {":2: tools[0].time_ms: is missing; give at least 0 ms"}},
    {"Syntax", "thickness_mm: [1, 2\nname: x", {"YAML syntax"}},
    {"Tab", "layer:\n\tk: 1", {":2: YAML syntax"}},
    {"Anchor", "layer: &a {k: 1}", {"anchors (&name) are not allowed"}},
    {"Alias", "name: *a", {"example.yaml"}},
    {"Tag", "name: !secret x", {"tags (!type) are not allowed"}},
    {"MergeKey", "<<: {iterations: 3}", {"<<: unknown key"}},
    {"Empty", "", {"is empty"}},
    {"OnlyComment", "# nothing\n", {"is empty"}},
    {"RootIsList", "- 1\n", {":1: must be a map"}},
    {"RootIsScalar", "hello\n", {":1: must be a map"}},
    {"TwoDocuments", "iterations: 3\n---\niterations: 4\n", {"has a second document"}},
    {"MapAsKey", "{a: 1}: 2\n", {"a key must be a word"}},
    {"Deep",
     "layer: [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]\n",
     {"nested deeper"}},
};

INSTANTIATE_TEST_SUITE_P(Rules, RefusedText, ::testing::ValuesIn(kBadCases),
                         [](const auto& test) { return test.param.rule; });

class StrictYamlFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("strict_yaml_test." + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string RefusalOf(std::string_view content) const {
    std::ofstream(folder_ / "f.yaml", std::ios::binary) << content;
    return Refusal([this] { StrictYaml::FromFile(folder_ / "f.yaml"); });
  }
  std::filesystem::path folder_;
};

TEST_F(StrictYamlFile, MissingFileIsRefusedByName) {
  const std::string said = Refusal([this] { StrictYaml::FromFile(folder_ / "none.yaml"); });
  EXPECT_NE(said.find("none.yaml: no such file"), std::string::npos) << said;
}

TEST_F(StrictYamlFile, FolderIsRefused) {
  const std::string said = Refusal([this] { StrictYaml::FromFile(folder_); });
  EXPECT_NE(said.find("not a regular file"), std::string::npos) << said;
}

TEST_F(StrictYamlFile, HugeFileIsRefused) {
  EXPECT_NE(RefusalOf("a: " + std::string((1 << 20) + 1, 'x')).find("larger than 1 MiB"), std::string::npos);
}

TEST_F(StrictYamlFile, BinaryFileIsRefusedWithItsLine) {
  const std::string said = RefusalOf(std::string("a: 1\nb: \0\1\2", 11));
  EXPECT_NE(said.find("f.yaml:2: is not a text file"), std::string::npos) << said;
}

TEST(StrictYaml, TextsAreUtf8) {
  const std::string good =
      "d: 20 \xc2\xb0"
      "C \xe2\x82\xac \xf0\x9f\x98\x80";
  StrictYaml file = StrictYaml::FromText(good, "f.yaml");
  EXPECT_EQ(file.root().Text("d"), good.substr(3));
  // Lone byte, too short, overlong, half of a surrogate pair, beyond the last character.
  for (const char* bad : {"\x92", "\xe2\x82", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff"}) {
    const std::string said = Refusal([&] { StrictYaml::FromText(std::string("a: 1\nb: ") + bad + "\n", "f.yaml"); });
    EXPECT_NE(said.find("f.yaml:2: is not a text file (not UTF-8 at byte "), std::string::npos) << said;
  }
}

TEST(StrictYaml, AskingTwiceIsABugOfTheCaller) {
  StrictYaml file = StrictYaml::FromText("a: 1", "x");
  StrictMap root = file.root();
  EXPECT_EQ(root.Number("a", Range::Any()), 1);
  EXPECT_THROW(root.Number("a", Range::Any()), std::logic_error);
}

TEST(StrictYaml, CallersRulesAreReportedAtTheKeysLine) {
  StrictYaml file = StrictYaml::FromText("a: 1\nb: 2\n", "x.yaml");
  StrictMap root = file.root();
  EXPECT_EQ(Refusal([&] { root.Fail("b", "must be below a"); }), "x.yaml:2: b: must be below a");
}

TEST(StrictYaml, KeysListsNamesThatTheFileChooses) {
  StrictYaml file = StrictYaml::FromText("z: {a: 1}\ny: {a: 2}\n", "x.yaml");
  StrictMap root = file.root();
  EXPECT_EQ(root.Keys(), (std::vector<std::string>{"z", "y"}));
  double sum = 0;
  for (const std::string& key : root.Keys()) {
    sum += root.Map(key).Number("a", Range::Any());
  }
  file.Finish();
  EXPECT_EQ(sum, 3);
}

TEST(Units, LongestSuffixNamesTheUnitOfAKey) {
  EXPECT_EQ(UnitOfKey("conductivity_W_mK")->dimension, "thermal conductivity");
  EXPECT_EQ(UnitOfKey("slew_N_per_ms")->dimension, "force rate");
  EXPECT_EQ(UnitOfKey("h_top_W_m2K")->dimension, "heat transfer");
  EXPECT_EQ(UnitOfKey("v_max_V")->dimension, "voltage");
  EXPECT_EQ(UnitOfKey("hand_stiffness_N_m")->dimension, "stiffness");
  EXPECT_EQ(UnitOfKey("iterations"), nullptr);
  EXPECT_EQ(UnitOfKey("_mm"), nullptr);
  EXPECT_EQ(UnitOfKey("m"), nullptr);
}

TEST(Units, SpellingsOfOneUnitAgree) {
  EXPECT_EQ(UnitOfSpelling("µm"), UnitOfSpelling("um"));
  EXPECT_EQ(UnitOfSpelling(" °C"), UnitOfSpelling("degC"));
  EXPECT_EQ(UnitOfSpelling("W/(m² K)"), UnitOfSpelling("W_m2K"));
  EXPECT_EQ(UnitOfSpelling("parsec"), nullptr);
}

}  // namespace
}  // namespace fulcrum::config
