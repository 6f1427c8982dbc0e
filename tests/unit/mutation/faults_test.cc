#include "tests/mutation/faults.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace fulcrum::mutation {
namespace {

/// The changed texts of a source, of one kind.
std::set<std::string> Changed(const std::string& source, const std::string& kind) {
  std::set<std::string> changed;
  for (const Fault& fault : FaultsOf(source)) {
    if (fault.kind == kind) changed.insert(WithFault(source, fault));
  }
  return changed;
}

TEST(Faults, ConstantsTermsAndUnits) {
  EXPECT_EQ(Changed("constexpr float k = 2.5e3f;\n", "constant"),
            (std::set<std::string>{"constexpr float k = 3000.0f;\n", "constexpr float k = 2000.0f;\n"}));
  EXPECT_EQ(Changed("constexpr float k = 2.5e3f;\n", "term"), std::set<std::string>{"constexpr float k = 0.0f;\n"});
  EXPECT_EQ(Changed("constexpr float k = 2.5e3f;\n", "unit"), std::set<std::string>{"constexpr float k = 2.5e0f;\n"});
  EXPECT_EQ(Changed("constexpr int k = 16;\n", "constant"), std::set<std::string>{"constexpr int k = 17;\n"});
  EXPECT_EQ(Changed("constexpr int k = 10'000;\n", "constant"), std::set<std::string>{"constexpr int k = 10001;\n"});
  EXPECT_TRUE(FaultsOf("a[3] = x1 + kN2;\n").size() == 1) << "an index and names are no constants";
}

TEST(Faults, SignsBordersConditionsAxesLimits) {
  EXPECT_EQ(Changed("y = a + b;\n", "sign"), std::set<std::string>{"y = a - b;\n"});
  EXPECT_EQ(Changed("if (i < n) {\n", "border"), std::set<std::string>{"if (i <= n) {\n"});
  EXPECT_EQ(Changed("if (a == b && c) {\n", "condition"),
            (std::set<std::string>{"if (a != b && c) {\n", "if (a == b || c) {\n"}));
  EXPECT_EQ(Changed("p.x();\n", "axis"), std::set<std::string>{"p.y();\n"});
  EXPECT_EQ(Changed("a = std::max(b, c);\n", "limit"), std::set<std::string>{"a = std::min(b, c);\n"});
}

TEST(Faults, SumsAndCallsAreLeftOut) {
  EXPECT_EQ(Changed("void F() {\n  sum[i] += a *\n         b;\n}\n", "term"),
            std::set<std::string>{"void F() {\n  ;\n}\n"});
  EXPECT_EQ(Changed("void F() {\n  tile->Wake(3);\n}\n", "call"), std::set<std::string>{"void F() {\n  ;\n}\n"});
}

TEST(Faults, EachOfSeveralCalls) {
  EXPECT_EQ(Changed("void F() {\n  A(1);\n  B(2);\n  C(3);\n}\n", "call").size(), 3u);
}

TEST(Faults, WhatIsNoCodeStays) {
  for (const char* source : {
           "// 2.5 + 3.5 < 4\n",
           "/* a + b\n   2.5 */\n",
           "f(\"2.5 + \\\" 3.5\");\n",
           "c = '\\'';\n",
           "#define K 2.5\n",
           "#define K \\\n  2.5\n",
           "static_assert(a == b);\n",
           "template <class A, int B = 2.5>\n",
       }) {
    EXPECT_TRUE(FaultsOf(source).empty()) << source;
  }
  EXPECT_EQ(FaultsOf("// 2.5\ny = a + b;  // a + b\n").size(), 1u);
}

TEST(Faults, AreDescribedByTheirLine) {
  const std::string source = "x = 0;\ny = a + b;\n";
  const std::vector<Fault> faults = FaultsOf(source);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(Describe(source, faults[0]), "2 sign  +  ->  - ");
}

}  // namespace
}  // namespace fulcrum::mutation
