// Mutations of the corpus (tests/fuzz/corpus/recording: small recordings, whole and cut, packed and plain), equal in
// every run: no bytes violate a property of the readers.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>
#include <vector>

#include "tests/fuzz/recording/recording_check.h"

namespace fulcrum::log_tools {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

constexpr int kInputs = 4000;

class RecordingFuzz : public testing::Test {
 protected:
  RecordingFuzz() { fs::create_directories(folder_); }
  ~RecordingFuzz() override { fs::remove_all(folder_); }

  static std::vector<Bytes> Corpus() {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(FULCRUM_SOURCE_DIR "/tests/fuzz/corpus/recording")) {
      files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());  // The same order everywhere.
    std::vector<Bytes> corpus;
    for (const fs::path& file : files) {
      std::ifstream in(file, std::ios::binary);
      corpus.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return corpus;
  }

  // Shared memory: thousands of small files on a disk would take minutes.
  const fs::path folder_ = "/dev/shm/fulcrum-recording-mutation-" + std::to_string(getpid());
};

void Mutate(std::mt19937_64* random, Bytes* bytes) {
  const auto below = [random](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>((*random)()) % n; };
  for (std::size_t edits = 1 + below(4); edits > 0 && !bytes->empty(); --edits) {
    const auto at = static_cast<std::ptrdiff_t>(below(bytes->size()));
    const auto end = at + static_cast<std::ptrdiff_t>(below(std::min<std::size_t>(64, bytes->size() - at)));
    switch (below(6)) {
      case 0:  // A bit.
        (*bytes)[at] = static_cast<std::uint8_t>((*bytes)[at] ^ (1u << below(8)));
        break;
      case 1:  // A length, as large as can be.
        (*bytes)[at] = 0xff;
        break;
      case 2:  // Cut off.
        bytes->resize(at);
        break;
      case 3:  // A piece is missing.
        bytes->erase(bytes->begin() + at, bytes->begin() + end);
        break;
      case 4: {  // A piece twice.
        const Bytes piece(bytes->begin() + at, bytes->begin() + end);
        bytes->insert(bytes->begin() + at, piece.begin(), piece.end());
        break;
      }
      default:  // A byte.
        (*bytes)[at] = static_cast<std::uint8_t>(below(256));
        break;
    }
  }
}

TEST_F(RecordingFuzz, CorpusHolds) {
  std::uint64_t messages = 0;
  for (const Bytes& bytes : Corpus()) {
    const RecordingVerdict verdict = CheckRecording(bytes, folder_);
    EXPECT_EQ(verdict.broken, "");
    messages += verdict.decoded;
  }
  EXPECT_EQ(messages, 19u);
}

TEST_F(RecordingFuzz, MutationsBreakNoPromise) {
  const std::vector<Bytes> corpus = Corpus();
  std::mt19937_64 random(21);
  std::uint64_t messages = 0, faults = 0;
  for (int input = 0; input < kInputs; ++input) {
    Bytes bytes = corpus[random() % corpus.size()];
    Mutate(&random, &bytes);
    const RecordingVerdict verdict = CheckRecording(bytes, folder_);
    ASSERT_EQ(verdict.broken, "") << "input " << input;
    messages += verdict.messages;
    faults += verdict.faults;
  }
  // Messages are read and faults are found.
  EXPECT_GT(messages, static_cast<std::uint64_t>(kInputs));
  EXPECT_GT(faults, static_cast<std::uint64_t>(kInputs / 4));
}

}  // namespace
}  // namespace fulcrum::log_tools
