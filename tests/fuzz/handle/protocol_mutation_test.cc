// A million mutations of the corpus (tests/fuzz/corpus/handle_serial: output of senders, and inputs that once caused a
// fault), equal in every run: no bytes violate a property of the parsers.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/handle/protocol_check.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr int kInputs = 1'000'000;

std::vector<std::string> Corpus() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(FULCRUM_SOURCE_DIR "/tests/fuzz/corpus/handle_serial")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());  // The same order everywhere.
  std::vector<std::string> corpus;
  for (const std::filesystem::path& file : files) {
    std::ifstream in(file, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return corpus;
}

/// A line as a sender writes it, with any value: mutations of the corpus alone seldom have a valid checksum.
std::string AnyLine(std::mt19937_64* random) {
  const auto value = static_cast<int>((*random)() % 1100);
  switch ((*random)() % 3) {
    case 0: {
      const auto frame = FormatFrame({"LRP"[(*random)() % 3], static_cast<std::uint8_t>((*random)()), value});
      return {frame.data(), frame.size()};
    }
    case 1: {
      const auto pedals = FormatPedals(static_cast<std::uint8_t>(value));
      return {pedals.data(), pedals.size()};
    }
    default: {
      char line[16];
      const int size = std::snprintf(line, sizeof(line), "%.4f\r\n", value * (5.0 / 1024));
      return {line, static_cast<std::size_t>(size)};
    }
  }
}

void Mutate(const std::vector<std::string>& corpus, std::mt19937_64* random, std::string* bytes) {
  const auto below = [random](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>((*random)()) % n; };
  constexpr std::size_t kMaxBytes = 64;
  for (std::size_t edits = below(5); edits > 0; --edits) {
    const std::size_t at = below(bytes->size());
    switch (below(7)) {
      case 0:  // A bit.
        if (!bytes->empty()) {
          (*bytes)[at] = static_cast<char>((*bytes)[at] ^ (1 << below(8)));
        }
        break;
      case 1:  // A byte.
        if (!bytes->empty()) {
          (*bytes)[at] = static_cast<char>(below(256));
        }
        break;
      case 2:  // A piece is missing.
        bytes->erase(at, 1 + below(4));
        break;
      case 3:  // A byte too many.
        bytes->insert(at, 1, static_cast<char>(below(256)));
        break;
      case 4:  // A piece twice.
        bytes->insert(at, bytes->substr(below(bytes->size()), below(12)));
        break;
      case 5:  // A valid line in the middle of it.
        bytes->insert(at, AnyLine(random));
        break;
      default:  // A piece of another input.
        bytes->insert(at, corpus[below(corpus.size())].substr(0, below(16)));
        break;
    }
    bytes->resize(std::min(bytes->size(), kMaxBytes));
  }
}

TEST(ProtocolFuzz, CorpusHolds) {
  const std::vector<std::string> corpus = Corpus();
  ASSERT_GE(corpus.size(), 6u);
  for (const std::string& bytes : corpus) {
    EXPECT_EQ(CheckProtocol(bytes).broken, "") << bytes;
  }
}

TEST(ProtocolFuzz, AMillionMutationsBreakNoPromise) {
  const std::vector<std::string> corpus = Corpus();
  std::mt19937_64 random(20);
  long good_lines = 0, good_frames = 0, good_pedals = 0;
  std::string bytes;
  for (int input = 0; input < kInputs; ++input) {
    bytes = corpus[random() % corpus.size()];
    Mutate(corpus, &random, &bytes);
    const ProtocolVerdict verdict = CheckProtocol(bytes);
    ASSERT_EQ(verdict.broken, "") << "input " << input << ": " << ::testing::PrintToString(bytes);
    good_lines += verdict.good_lines;
    good_frames += verdict.good_frames;
    good_pedals += verdict.good_pedals;
  }
  // Each kind of line is accepted often, and most inputs are damaged.
  EXPECT_GT(good_lines, kInputs / 20);
  EXPECT_GT(good_frames, kInputs / 20);
  EXPECT_GT(good_pedals, kInputs / 20);
}

}  // namespace
}  // namespace fulcrum::handle_bridge
