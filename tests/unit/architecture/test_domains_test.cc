// The DDS domains of the tests that start processes: each test has its own, so that what one leaves behind, or another
// checkout runs, does not reach the next, and a report of a domain names its test.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

/// The lines of a file that can name a domain; the rest would cost the search seconds.
std::string LinesOf(const fs::path& file) {
  std::ifstream stream(file);
  std::string text;
  for (std::string line; std::getline(stream, line);) {
    const auto has = [&line](const char* word) { return line.find(word) != std::string::npos; };
    if (has("omain") || has("Cart") || has("withConsole")) text += line + "\n";
  }
  return text;
}

/// Domains in the text of a test: of constants k...Domain and their sums with a number, of the option --domain, of
/// testing::Cart and of the page's withConsole.
std::set<int> DomainsIn(const std::string& text) {
  static const std::regex kConstant(R"re(\bk(\w*Domain|Cart|Host|Between) = "?(\d+))re"),
      kSum(R"([(,] ?kDomain \+ (\d+))"), kOption(R"re(--domain(?:", "| )(\d+))re"),
      kCart(R"re(\bCart \w+\("[^"]+", (\d+))re"), kPage(R"(withConsole\(\w+, \w+, (\d+))");
  std::set<int> domains;
  const auto each = [&text](const std::regex& pattern, const auto& use) {
    for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) use(*match);
  };
  int base = 0;
  each(kConstant, [&](const std::smatch& match) {
    domains.insert(std::stoi(match[2]));
    if (match[1] == "Domain") base = std::stoi(match[2]);
  });
  each(kSum, [&](const std::smatch& match) { domains.insert(base + std::stoi(match[1])); });
  for (const std::regex* pattern : {&kOption, &kCart, &kPage}) {
    each(*pattern, [&](const std::smatch& match) { domains.insert(std::stoi(match[1])); });
  }
  return domains;
}

TEST(TestDomains, AreFoundInEachForm) {
  EXPECT_EQ(DomainsIn("constexpr int kDomain = 12, kOtherDomain = 13; Run(kDomain + 2);"), (std::set<int>{12, 13, 14}));
  EXPECT_EQ(DomainsIn(R"({"--domain", "21"}; "up --domain 22"; Cart cart("small", 23, {}); kDomain = "24";)"),
            (std::set<int>{21, 22, 23, 24}));
  EXPECT_EQ(DomainsIn("await withConsole(fulcrum, browser, 65, async"), std::set<int>{65});
}

TEST(TestDomains, BelongToOneTestEach) {
  // Programs that measure or show, which no test starts.
  const std::set<std::string> kNoTests{"measure.mjs", "measure_hands.mjs", "remote.mjs"};
  std::map<int, std::set<std::string>> users;
  for (const char* kind : {"integration", "system"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(FULCRUM_SOURCE_DIR) / "tests" / kind)) {
      const fs::path& file = entry.path();
      if ((file.extension() != ".cc" && file.extension() != ".mjs") || kNoTests.contains(file.filename())) continue;
      for (const int domain : DomainsIn(LinesOf(file))) {
        users[domain].insert(fs::relative(file, FULCRUM_SOURCE_DIR));
      }
    }
  }
  EXPECT_GT(users.size(), 40u) << "the domains are not found";
  std::set<int> taken;
  for (const auto& [domain, files] : users) taken.insert(domain);
  std::string free;
  for (int domain = 1; domain <= 100; ++domain) {
    if (!taken.contains(domain)) free += std::to_string(domain) + " ";
  }
  for (const auto& [domain, files] : users) {
    std::string names;
    for (const std::string& file : files) names += "\n  " + file;
    EXPECT_EQ(files.size(), 1u) << "domain " << domain << " is used by" << names << "\nfree domains: " << free;
  }
}

}  // namespace
}  // namespace fulcrum
