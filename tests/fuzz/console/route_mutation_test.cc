// Two hundred thousand requests, mutated from good ones, the same in every run.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/console/route_check.h"

namespace fulcrum::console {
namespace {

using testing::Broken;
using testing::RequestFrom;

std::vector<std::string> Corpus() {
  std::vector<std::string> texts;
  for (const auto& entry : std::filesystem::directory_iterator(FULCRUM_SOURCE_DIR "/tests/fuzz/corpus/console_route")) {
    std::ifstream file(entry.path(), std::ios::binary);
    texts.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return texts;
}

const std::vector<std::string> kAwkward{"..",   "/",     "%2e",  "%00",   "%",  "&",   "=",
                                        "?",    "\n",    "\r",   ":",     "[",  "]",   "#",
                                        "evil", "TOKEN", "\xff", "name=", "//", "api", std::string(300, 'A')};

TEST(ConsoleRoutes, MutatedRequestsBreakNoPromise) {
  const std::vector<std::string> corpus = Corpus();
  ASSERT_GE(corpus.size(), 8u);
  std::mt19937_64 random(5);
  int accepted = 0, refused = 0;
  for (int i = 0; i < 200'000; ++i) {
    std::string text = corpus[random() % corpus.size()];
    for (std::uint64_t n = random() % 4; n > 0; --n) {
      const std::size_t at = random() % (text.size() + 1);
      switch (random() % 4) {
        case 0:
          if (at < text.size()) text[at] = static_cast<char>(random());
          break;
        case 1:
          text.insert(at, kAwkward[random() % kAwkward.size()]);
          break;
        case 2:
          text.erase(at, 1 + random() % 6);
          break;
        default:
          text.insert(at, corpus[random() % corpus.size()].substr(0, random() % 40));
      }
    }
    const HttpRequest request = RequestFrom(text);
    ASSERT_EQ(Broken(request), "") << "input " << i << ":\n" << text;
    (Route(Access(testing::kToken, {}), request).routed ? accepted : refused) += 1;
  }
  // Both outcomes must occur; otherwise the test checks nothing.
  EXPECT_GT(accepted, 20'000);
  EXPECT_GT(refused, 20'000);
}

}  // namespace
}  // namespace fulcrum::console
