// Thousands of mutations of a valid file of every variant, equal in every run: each is read or refused, and no
// announced count makes the reader allocate more than the file's bytes justify.
#include <gtest/gtest.h>

#include <random>

#include "tests/fuzz/scene/largest_allocation.h"
#include "tests/fuzz/scene/mesh_check.h"

namespace fulcrum::scene {
namespace {

constexpr int kMutations = 4000;
/// Largest block that the reader of a file of n bytes may allocate: 64 n and a constant, because a byte of text or of a
/// packed list becomes a few numbers of at most 8 bytes, in vectors that double. zlib packs up to 1032 bytes into one,
/// so a damaged size is accepted up to that factor.
std::size_t AllowedBytes(const MeshSample& sample, std::size_t file_bytes) {
  const bool is_packed = sample.label.find("zlib") != std::string::npos;
  return (is_packed ? 2 * 1032 : 64) * file_bytes + 65536;
}

/// Numbers that are likely to do harm where a count, an index or an offset stands.
const char* const kNumbers[] = {
    "0",      "-1",   "1", "4294967295", "18446744073709551615", "9999999", "-2147483648", "3", "1e9", "nan", "inf",
    "1e-320", "0x10", ""};

std::string Mutate(std::string bytes, const std::string& other, std::mt19937* random) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>((*random)()) % n; };
  const std::size_t rounds = 1 + below(3);
  for (std::size_t k = 0; k < rounds && !bytes.empty(); ++k) {
    const std::size_t at = below(bytes.size());
    switch (below(8)) {
      case 0:  // A bit.
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 1:  // A byte.
        bytes[at] = static_cast<char>(below(256));
        break;
      case 2:  // The end is missing.
        bytes.resize(at);
        break;
      case 3:  // A piece is missing.
        bytes.erase(at, below(40));
        break;
      case 4:  // A piece is there twice.
        bytes.insert(at, bytes.substr(below(bytes.size()), below(60)));
        break;
      case 5: {  // A number becomes another one.
        const std::size_t begin = bytes.find_first_of("0123456789", at);
        if (begin != std::string::npos) {
          const std::size_t end = bytes.find_first_not_of("0123456789", begin);
          bytes.replace(begin, end == std::string::npos ? end : end - begin, kNumbers[below(std::size(kNumbers))]);
        }
        break;
      }
      case 6: {  // Binary sizes: all ones, or a huge one.
        const std::size_t count = std::min(bytes.size() - at, std::size_t{1} << below(4));
        bytes.replace(at, count, std::string(count, below(2) == 0 ? '\xff' : '\x7f'));
        break;
      }
      default: {  // A piece of another variant of the format.
        const std::size_t from = below(other.size());
        bytes.replace(at, std::min<std::size_t>(40, bytes.size() - at), other.substr(from, below(60)));
        break;
      }
    }
  }
  return bytes;
}

class MutatedMeshFile : public testing::TestWithParam<MeshSample> {};

TEST_P(MutatedMeshFile, IsReadOrRefusedWithinBounds) {
  const MeshSample& sample = GetParam();
  std::string other = sample.bytes;
  for (const MeshSample& s : MeshSamples()) {
    if (s.name == sample.name && s.label != sample.label) {
      other = s.bytes;
    }
  }
  std::mt19937 random(static_cast<unsigned>(sample.bytes.size()));
  int read = 0;
  for (int i = 0; i < kMutations; ++i) {
    const std::string bytes = Mutate(sample.bytes, other, &random);
    g_largest_allocation = 0;
    read += CheckBytes(sample, bytes) ? 1 : 0;
    ASSERT_LE(g_largest_allocation.load(), AllowedBytes(sample, bytes.size())) << "mutation " << i;
  }
  // Some files are read and some are refused.
  EXPECT_GT(read, kMutations / 100);
  EXPECT_LT(read, kMutations * 9 / 10);
}

/// A damaged companion file is handled as safely as the file itself.
TEST_P(MutatedMeshFile, CompanionsToo) {
  if (GetParam().beside.empty()) {
    return;
  }
  MeshSample sample = GetParam();
  const auto [name, bytes] = *sample.beside.begin();
  std::mt19937 random(3);
  for (int i = 0; i < kMutations; ++i) {
    sample.beside[name] = Mutate(bytes, sample.bytes, &random);
    g_largest_allocation = 0;
    (void)CheckBytes(sample, sample.bytes);
    ASSERT_LE(g_largest_allocation.load(), AllowedBytes(sample, sample.bytes.size() + sample.beside[name].size()));
  }
}

INSTANTIATE_TEST_SUITE_P(MeshFiles, MutatedMeshFile, testing::ValuesIn(MeshSamples()),
                         [](const auto& test) { return test.param.label; });

}  // namespace
}  // namespace fulcrum::scene
