// Tests of a node against a recording: the assertions, the result, the report for a CI system.
#include "services/apps/replayer/node_test.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

TEST(Assertions, AreReadHoweverTheyAreSpaced) {
  for (const char* text :
       {"cut_length_mm>30", "cut_length_mm > 30", "  cut_length_mm >30.0 ", "cut_length_mm\t>\t+3e1"}) {
    const Assertion assertion = ParseAssertion(text);
    EXPECT_EQ(assertion.figure, "cut_length_mm") << text;
    EXPECT_EQ(assertion.relation, Relation::kMore) << text;
    EXPECT_EQ(assertion.bound, 30) << text;
    EXPECT_EQ(TextOf(assertion), "cut_length_mm > 30");
  }
  EXPECT_EQ(ParseAssertion("force0_N.max <= -0.5").figure, "force0_N.max");
  EXPECT_EQ(ParseAssertion("force0_N.max <= -0.5").bound, -0.5);
}

TEST(Assertions, HoldOrNot) {
  struct Case {
    const char* text;
    bool below, at, above;  ///< Results of the comparison of 1, 2 and 3 with 2.
  };
  for (const Case& c :
       {Case{"x < 2", true, false, false}, Case{"x <= 2", true, true, false}, Case{"x == 2", false, true, false},
        Case{"x != 2", true, false, true}, Case{"x >= 2", false, true, true}, Case{"x > 2", false, false, true}}) {
    const Assertion assertion = ParseAssertion(c.text);
    EXPECT_EQ(Holds(assertion, 1), c.below) << c.text;
    EXPECT_EQ(Holds(assertion, 2), c.at) << c.text;
    EXPECT_EQ(Holds(assertion, 3), c.above) << c.text;
    EXPECT_FALSE(Holds(assertion, std::numeric_limits<double>::quiet_NaN())) << c.text;
  }
}

/// Message of the InputError for `text`, or nothing.
std::string Refusal(const std::string& text) {
  try {
    (void)ParseAssertion(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(Assertions, BadOnesAreRefusedWithThePlaceAndTheGrammar) {
  struct Case {
    const char* text;
    const char* place;
    const char* what;
  };
  const Case cases[] = {
      {"", "character 1:", "name of a figure is missing"},
      {"   ", "character 4:", "name of a figure is missing"},
      {"> 30", "character 1:", "name of a figure is missing"},
      {"3x > 1", "character 1:", "name of a figure is missing"},
      {".max > 1", "character 1:", "name of a figure is missing"},
      {"cut_length_mm", "character 14:", "a comparison is missing"},
      {"cut_length_mm 30", "character 15:", "a comparison is missing"},
      {"cut_length_mm => 30", "character 15:", "\"==\" is"},
      {"cut_length_mm = 30", "character 15:", "\"==\" is"},
      {"cut length > 3", "character 5:", "a comparison is missing"},
      {"cut_length_mm >", "character 16:", "a number is missing"},
      {"cut_length_mm > > 3", "character 17:", "a number is missing"},
      {"cut_length_mm > long", "character 17:", "a number is missing"},
      {"cut_length_mm > nan", "character 17:", "a number is missing"},
      {"cut_length_mm > -inf", "character 17:", "a number is missing"},
      {"cut_length_mm > +-3", "character 17:", "a number is missing"},
      {"cut_length_mm > 1e999", "character 17:", "out of range"},
      {"cut_length_mm > 0x10", "character 18:", "text after the number"},
      {"cut_length_mm > 30 mm", "character 20:", "text after the number"},
      {"a > 1 && b < 2", "character 7:", "one --assert for each"},
      {"a < 1 < 2", "character 7:", "text after the number"},
  };
  for (const Case& c : cases) {
    const std::string said = Refusal(c.text);
    EXPECT_NE(said.find("--assert \"" + std::string(c.text) + '"'), std::string::npos) << c.text << " -> " << said;
    EXPECT_NE(said.find(c.place), std::string::npos) << c.text << " -> " << said;
    EXPECT_NE(said.find(c.what), std::string::npos) << c.text << " -> " << said;
    EXPECT_NE(said.find("FIGURE < | <= | == | != | >= | > NUMBER"), std::string::npos) << said;
  }
}

TEST(StateHashes, AreSixteenDigits) {
  EXPECT_EQ(ParseStateHash("0123456789abcdef"), 0x0123456789abcdefull);
  EXPECT_EQ(ParseStateHash("0xFFFFFFFFFFFFFFFF"), ~0ull);
  for (const char* text : {"", "0x", "123", "0123456789abcdefa", "0123456789abcdeg", "-123456789abcdef", "recorded"}) {
    EXPECT_THROW((void)ParseStateHash(text), InputError) << text;
  }
}

NodeTestResult SomeResult() {
  NodeTestResult result;
  result.node = NodeId::kThermal;
  result.recording = "out/<a & b>/recording.mcap";
  result.figures = {{"cut_length_mm", 12.5}, {"cut_length_mm.max", 13}, {"hash_mismatches", 0}};
  result.state_hash = 0xabc;
  return result;
}

TEST(Judgement, IsACaseForEachDemand) {
  NodeTestResult result = SomeResult();
  Judge({0xabc, {ParseAssertion("cut_length_mm > 10"), ParseAssertion("cut_length_mm.max > 30")}}, &result);
  ASSERT_EQ(result.cases.size(), 3u);
  EXPECT_EQ(result.cases[0].verdict, Verdict::kPassed);
  EXPECT_EQ(result.cases[1].verdict, Verdict::kPassed);
  EXPECT_EQ(result.cases[2].verdict, Verdict::kFailed);
  EXPECT_EQ(result.cases[2].message, "cut_length_mm.max is 13");
  EXPECT_FALSE(result.passed());
  EXPECT_NE(ReportText(result).find("FAILED cut_length_mm.max > 30: cut_length_mm.max is 13"), std::string::npos);

  result = SomeResult();
  Judge({0xabd, {}}, &result);
  EXPECT_EQ(result.cases.at(0).message, "state_hash is 0000000000000abc");
  EXPECT_FALSE(result.passed());
}

TEST(Judgement, AnUnknownFigureIsRefusedWithThoseThereAre) {
  NodeTestResult result = SomeResult();
  try {
    Judge({{}, {ParseAssertion("cut_lenght_mm > 10")}}, &result);
    FAIL() << "a missing figure was accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("thermal_node has no figure \"cut_lenght_mm\""), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("cut_length_mm, hash_mismatches"), std::string::npos) << error.what();
  }
}

TEST(JUnit, CountsFailuresAndErrorsAndEscapesWhatXmlReserves) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("fulcrum_junit_" + std::to_string(::getpid()) + ".xml");
  NodeTestResult result = SomeResult();
  Judge({{}, {ParseAssertion("cut_length_mm > 10"), ParseAssertion("cut_length_mm < 10")}}, &result);
  result.cases.push_back({"replays the whole recording", Verdict::kError, "ToolState #7 is not in the recording"});
  WriteJUnit(result, file);
  std::ifstream in(file);
  const std::string xml{std::istreambuf_iterator<char>(in), {}};
  std::filesystem::remove(file);
  EXPECT_TRUE(xml.starts_with("<?xml version=\"1.0\" encoding=\"UTF-8\"?>")) << xml;
  for (const char* part :
       {"<testsuite name=\"thermal_node\" tests=\"3\" failures=\"1\" errors=\"1\"",
        "<property name=\"recording\" value=\"out/&lt;a &amp; b&gt;/recording.mcap\"/>",
        "<property name=\"state_hash\" value=\"0000000000000abc\"/>",
        "<testcase classname=\"fulcrum.thermal_node\" name=\"cut_length_mm &gt; 10\" time=\"0\"/>",
        "<failure message=\"cut_length_mm is 12.5\">cut_length_mm &lt; 10: cut_length_mm is 12.5</failure>",
        "<error message=\"ToolState #7 is not in the recording\">", "</testsuites>"}) {
    EXPECT_NE(xml.find(part), std::string::npos) << part << " is missing in\n" << xml;
  }
  EXPECT_THROW(WriteJUnit(result, "/nonexistent/result.xml"), InputError);
}

}  // namespace
}  // namespace fulcrum::replay
