// Mutations of valid checkpoints, equal in every run.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>

#include "services/base/core/sanitizers.h"
#include "tests/fuzz/checkpoint/checkpoint_check.h"
#include "tests/fuzz/target.h"

namespace fulcrum {
namespace {

using testing::CheckpointCheck;
using testing::Outcome;

#if FULCRUM_SANITIZED
constexpr int kInputs = 20;
#else
constexpr int kInputs = 120;
#endif

constexpr std::array<std::uint32_t, 8> kAwkward{0,          1,          0x7fffffff, 0x80000000,
                                                0xffffffff, 0x7fc00000, 0x7f800000, 0x7149f2ca};

std::vector<std::byte> Mutate(std::vector<std::byte> payload, std::mt19937* random) {
  const unsigned count = 1 + (*random)() % 3;
  for (unsigned i = 0; i < count && payload.size() > 8; ++i) {
    // Half of them in the header, which contains the counts.
    const std::size_t reach = (*random)() % 2 == 0 ? std::min<std::size_t>(payload.size(), 400) : payload.size();
    const std::size_t word = ((*random)() % (reach - 4)) & ~std::size_t{3};
    const std::uint32_t value = (*random)() % 3 == 0 ? (*random)() : kAwkward[(*random)() % kAwkward.size()];
    switch ((*random)() % 8) {
      case 0:
        payload.resize((*random)() % payload.size());
        break;
      case 1:
        payload[word] ^= std::byte{static_cast<unsigned char>(1u << (*random)() % 8)};
        break;
      case 2:
        payload.push_back(std::byte{7});
        break;
      default:
        std::memcpy(payload.data() + word, &value, 4);
    }
  }
  return payload;
}

void HoldMutants(CheckpointCheck* check) {
  ASSERT_EQ(check->Offer(check->good()), Outcome::kTaken);
  std::mt19937 random(3);
  std::array<int, 3> outcomes{};
  for (int i = 0; i < kInputs; ++i) {
    const Outcome outcome = check->Offer(Mutate(check->good(), &random));
    ++outcomes[static_cast<std::size_t>(outcome)];
    EXPECT_NE(outcome, Outcome::kBroken) << "input " << i;
  }
  // Both outcomes must occur; otherwise the test checks nothing.
  EXPECT_GT(outcomes[0], kInputs / 10);
  EXPECT_GT(outcomes[1], kInputs / 10);
}

void Hold(CheckpointCheck* check, const std::string& corpus) {
  HoldMutants(check);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(corpus)) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    std::vector<std::byte> payload = check->good();
    fuzz::Patch(bytes, &payload);
    EXPECT_NE(check->Offer(payload), Outcome::kBroken) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 4);
}

constexpr const char* kCorpus = FULCRUM_SOURCE_DIR "/tests/fuzz/corpus/checkpoint_";

TEST(CheckpointMutation, PhysicsRefusesOrGoesOn) {
  Hold(testing::MakePhysicsCheck().get(), std::string(kCorpus) + "physics");
}

TEST(CheckpointMutation, SolidsRefuseOrGoOn) { HoldMutants(testing::MakeSolidCheck().get()); }

TEST(CheckpointMutation, ThermalRefusesOrGoesOn) {
  Hold(testing::MakeThermalCheck().get(), std::string(kCorpus) + "thermal");
}

}  // namespace
}  // namespace fulcrum
