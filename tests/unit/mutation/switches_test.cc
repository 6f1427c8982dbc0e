#include "tests/mutation/switches.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace fulcrum::mutation {
namespace {

/// The source with all faults of a kind as switches from 7 on, without the lines before it.
std::string Switched(const std::string& source, const std::string& kind) {
  std::vector<Switch> switches;
  for (const Fault& fault : FaultsOf(source)) {
    if (fault.kind == kind) switches.push_back({fault, 7 + static_cast<int>(switches.size())});
  }
  const std::string text = WithSwitches(source, switches, "a.cc");
  const std::string head = "#include \"tests/mutation/switch.h\"\n#line 1 \"a.cc\"\n";
  EXPECT_EQ(text.substr(0, head.size()), head);
  return text.substr(head.size());
}

TEST(Switches, AllFaultsOfANumberAreOneExpression) {
  EXPECT_EQ(Switched("x = 2.5f;\n", "constant"),
            "x = (::fulcrum::mutation::Faulty(8) ? 2.0f : ::fulcrum::mutation::Faulty(7) ? 3.0f : 2.5f);\n");
}

TEST(Switches, ConstantsBecomeVariables) {
  EXPECT_EQ(Switched("constexpr float kA = 2.5f;\nconstexpr float kB = 2 * kA;\nconstexpr int kC = 1;\n", "term"),
            "const     float kA = (::fulcrum::mutation::Faulty(7) ? 0.0f : 2.5f);\nconst     float kB = 2 * kA;\n"
            "constexpr int kC = 1;\n");
}

TEST(Switches, OperatorsKeepTheirPrecedence) {
  EXPECT_EQ(Switched("y = a * b - c * d;\n", "sign"), "y = a * b - ::fulcrum::mutation::Place<'-'>{7} - c * d;\n");
  EXPECT_EQ(Switched("if (a <= b) {\n", "border"), "if (a <= ::fulcrum::mutation::Place<'l'>{7} <= b) {\n");
  EXPECT_EQ(Switched("if (a != b) {\n", "condition"), "if (a != ::fulcrum::mutation::Place<'!'>{7} != b) {\n");
}

TEST(Switches, AChainOfConditionsIsWrittenTwice) {
  EXPECT_EQ(Switched("const bool x = a && (b || c);\n", "condition"),
            "const bool x =(::fulcrum::mutation::Faulty(7) ? ( a || (b || c)) : ( a && (b || c)));\n");
}

TEST(Switches, AxesLimitsAndStatements) {
  EXPECT_EQ(Switched("p.z();\n", "axis"), "p[::fulcrum::mutation::Faulty(7) ? 0 : 2];\n");
  EXPECT_EQ(Switched("a = std::max(b, c);\n", "limit"), "a = ::fulcrum::mutation::Max(7, b, c);\n");
  EXPECT_EQ(Switched("void F() {\n  Wake(3);\n}\n", "call"),
            "void F() {\n  { if (!::fulcrum::mutation::Faulty(7)) { Wake(3); } }\n}\n");
}

TEST(Switches, LinesKeepTheirNumbers) {
  EXPECT_EQ(Switched("if (a &&\n    b && c) {\n", "condition"),
            "if ((::fulcrum::mutation::Faulty(7) ? (a &&     b || c) : (a &&\n    b && c))) {\n");
}

}  // namespace
}  // namespace fulcrum::mutation
