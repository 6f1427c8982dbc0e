// Thousands of mutations of small DICOM segmentations, equal in every run: each is read or refused, within the memory
// that its grid and its bytes justify.
#include <gtest/gtest.h>

#include <random>

#include "tests/fuzz/scene/dicom_samples.h"
#include "tests/fuzz/scene/largest_allocation.h"

namespace fulcrum::fuzz {
namespace {

constexpr int kMutations = 4000;
/// Besides the labels: counts of 65536 of them, of 8 bytes.
constexpr std::size_t kFixed_B = 600000;

Bytes Mutate(Bytes bytes, const Bytes& other, std::mt19937* random) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>((*random)()) % n; };
  const std::size_t rounds = 1 + below(3);
  for (std::size_t k = 0; k < rounds && bytes.size() > 140; ++k) {
    const std::size_t at = 132 + below(bytes.size() - 132);
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const auto some = static_cast<std::ptrdiff_t>(std::min<std::size_t>(below(40), bytes.size() - at));
    switch (below(7)) {
      case 0:  // A bit.
        *place = static_cast<std::uint8_t>(*place ^ (1u << below(8)));
        break;
      case 1:  // A byte.
        *place = static_cast<std::uint8_t>(below(256));
        break;
      case 2:  // The end is missing.
        if (below(4) == 0) bytes.resize(at);
        break;
      case 3:  // A piece is missing.
        bytes.erase(place, place + some);
        break;
      case 4: {  // A piece is there twice.
        const Bytes piece(place, place + some);
        bytes.insert(place, piece.begin(), piece.end());
        break;
      }
      case 5:  // Lengths: all ones, or a huge one.
        std::fill(place, place + std::min<std::ptrdiff_t>(some, 4), below(2) == 0 ? 0xff : 0x7f);
        break;
      default: {  // A piece of another kind of file, or a digit.
        if (below(2) == 0) {
          const auto digit = std::find_if(place, bytes.end(), [](std::uint8_t b) { return b >= '0' && b <= '9'; });
          if (digit != bytes.end()) *digit = static_cast<std::uint8_t>("0123456789.-e\\"[below(14)]);
        } else {
          const std::size_t from = std::min(at, other.size());
          std::copy_n(other.begin() + static_cast<std::ptrdiff_t>(from),
                      std::min<std::ptrdiff_t>(some, static_cast<std::ptrdiff_t>(other.size() - from)), place);
        }
        break;
      }
    }
  }
  return bytes;
}

TEST(MutatedDicomFile, IsReadOrRefusedWithinBounds) {
  const std::vector<Seed> samples = DicomSamples();
  MemoryFile file;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    // Reads DCMTK's dictionary.
    file.Write(samples[s].bytes);
    ASSERT_TRUE(ReadAnyDicom(file.path()));
    std::mt19937 random(static_cast<unsigned>(s));
    int read = 0;
    for (int i = 0; i < kMutations; ++i) {
      const Bytes bytes = Mutate(samples[s].bytes, samples[(s + 1) % samples.size()].bytes, &random);
      file.Write(bytes);
      g_largest_allocation = 0;
      const std::optional<scene::LabelMap> map = ReadAnyDicom(file.path());
      read += map ? 1 : 0;
      const std::size_t labels_B = map ? 2 * map->labels.size() : 0;
      ASSERT_LE(g_largest_allocation.load(), std::max(labels_B, 64 * bytes.size() + kFixed_B)) << "mutation " << i;
    }
    // Some are read and some are refused.
    EXPECT_GT(read, kMutations / 20) << samples[s].name;
    EXPECT_LT(read, kMutations * 19 / 20) << samples[s].name;
  }
}

}  // namespace
}  // namespace fulcrum::fuzz
