// A million contact models, mutated from valid ones, equal in every run.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <vector>

#include "haptics_node/servo/model_gate.h"
#include "services/base/core/sanitizers.h"
#include "tests/fuzz/haptics/gate_check.h"

namespace fulcrum::haptics {
namespace {

using testing::GateCheck;

#if FULCRUM_SANITIZED
constexpr int kInputs = 20'000;  ///< A sanitizer makes the test some thirty times as slow and needs fewer inputs.
#else
constexpr int kInputs = 1'000'000;
#endif
constexpr int kInputsPerServo =
    2000;  ///< Then a new servo: an earlier message may have made the old one refuse valid messages.

/// Numbers at which comparisons and conversions go wrong, and the gate's own limits.
const std::array<float, 22> kAwkward{0.0f,
                                     -0.0f,
                                     std::numeric_limits<float>::quiet_NaN(),
                                     std::numeric_limits<float>::signaling_NaN(),
                                     std::numeric_limits<float>::infinity(),
                                     -std::numeric_limits<float>::infinity(),
                                     std::numeric_limits<float>::max(),
                                     std::numeric_limits<float>::lowest(),
                                     std::numeric_limits<float>::denorm_min(),
                                     std::numeric_limits<float>::min(),
                                     1e-20f,
                                     -1.0f,
                                     1.0f,
                                     kMinBodyStiffness_N_m,
                                     kMaxBodyStiffness_N_m,
                                     kMaxSkinStiffness_N_m,
                                     kMaxCubicStiffness,
                                     kMaxBodyViscosity_Ns_m,
                                     kMaxReferenceForce_N,
                                     kMaxCurvature_per_m,
                                     kMaxRate_m_s,
                                     kMaxPlace_m};

class Mutator {
 public:
  void Mutate(ContactModel* model) {
    const std::uint64_t how = random_();
    const std::size_t count = 1 + how % 4;
    for (std::size_t i = 0; i < count; ++i) MutateOnce(model);
  }

 private:
  void Write(std::size_t at, const void* data, std::size_t size, ContactModel* model) {
    GateCheck::Apply({at, {static_cast<const std::uint8_t*>(data), size}}, model);
  }
  void MutateOnce(ContactModel* model) {
    // Half of them in the used part: the stamps and the first device's two contacts.
    constexpr std::size_t kUsed = offsetof(ContactModel, devices) + 2 * sizeof(Contact);
    const std::size_t at = random_() % (random_() % 2 == 0 ? kUsed : sizeof(ContactModel));
    const std::size_t word = at & ~std::size_t{3};
    const std::uint64_t bits = random_();
    switch (random_() % 6) {
      case 0: {  // A bit.
        auto* const bytes = reinterpret_cast<std::uint8_t*>(model);
        bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << (bits % 8)));
        return;
      }
      case 1:  // An awkward number.
        return Write(word, &kAwkward[bits % kAwkward.size()], 4, model);
      case 2: {  // A number next to an awkward one.
        const auto near = std::bit_cast<std::uint32_t>(kAwkward[bits % kAwkward.size()]) + (bits & 64 ? 1u : ~0u);
        return Write(word, &near, 4, model);
      }
      case 3:  // Anything, four or eight bytes.
        return Write(word, &bits, bits % 2 == 0 ? 4 : 8, model);
      case 4: {  // A number scaled by decades.
        float value = 0;
        std::memcpy(&value, reinterpret_cast<const std::uint8_t*>(model) + word, 4);
        value *= std::pow(10.0f, static_cast<float>(bits % 9) - 4.0f);
        return Write(word, &value, 4, model);
      }
      default: {  // A piece of it moved elsewhere.
        const std::array<std::uint8_t, 64> piece = [&] {
          std::array<std::uint8_t, 64> copy{};
          std::memcpy(copy.data(), reinterpret_cast<const std::uint8_t*>(model) + bits % (sizeof(*model) - 64), 64);
          return copy;
        }();
        return Write(word, piece.data(), 4 + (bits >> 32) % 60, model);
      }
    }
  }
  std::mt19937_64 random_{11};
};

TEST(GateMutation, AMillionMessagesNeverBreakTheForce) {
  Mutator mutator;
  std::uint64_t refused = 0, offered = 0;
  double peak = 0;
  while (offered < kInputs) {
    GateCheck check;
    for (int i = 0; i < kInputsPerServo; ++i) {
      ContactModel model = check.Good();
      // Every tenth message is valid, so that the force is not zero.
      if (i % 10 != 0) mutator.Mutate(&model);
      ASSERT_TRUE(check.Offer(model)) << "input " << offered + check.offered();
    }
    offered += check.offered();
    refused += check.refused();
    peak = std::max(peak, check.peak_N());
  }
  // Both outcomes must occur; otherwise the test checks nothing.
  EXPECT_GT(refused, offered / 4);
  EXPECT_GT(offered - refused, offered / 4);
  EXPECT_GT(peak, 1.0);
}

TEST(GateMutation, TheCorpusHolds) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FULCRUM_SOURCE_DIR "/tests/fuzz/corpus/haptics_gate")) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    EXPECT_FALSE(bytes.empty()) << entry.path();
    EXPECT_TRUE(testing::Survives(bytes)) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 6);
}

}  // namespace
}  // namespace fulcrum::haptics
