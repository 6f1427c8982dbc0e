// libFuzzer's entry for one target: FULCRUM_FUZZ_MAKE is the function that makes it. `PROGRAM --seeds FOLDER
// DICTIONARY` writes the inputs that the target must accept and ends. At the end the count of inputs and of those that
// were accepted is printed: a target that refuses nearly everything tests nothing.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/fuzz/target.h"

namespace {

using fulcrum::fuzz::Outcome;
using fulcrum::fuzz::Target;

unsigned long long g_inputs = 0, g_accepted = 0;

Target& TheTarget() {
  // Never destroyed: libFuzzer ends the process without destructors.
  static Target* const target = fulcrum::fuzz::FULCRUM_FUZZ_MAKE().release();
  return *target;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** values) {
  if (*count == 4 && std::string_view((*values)[1]) == "--seeds") {
    const std::filesystem::path folder = (*values)[2];
    std::filesystem::create_directories(folder);
    for (const fulcrum::fuzz::Seed& seed : TheTarget().Seeds()) {
      fulcrum::fuzz::WriteFile(folder / seed.name, seed.bytes);
    }
    // One word per line, in quotation marks; the words contain none.
    std::string dictionary;
    for (const std::string& word : TheTarget().Words()) dictionary.append("\"").append(word).append("\"\n");
    fulcrum::fuzz::WriteFile((*values)[3], fulcrum::fuzz::BytesOf(dictionary));
    std::exit(0);
  }
  // Made before the first input, so that its time does not count for the detection of hangs.
  (void)TheTarget();
  std::atexit([] { std::fprintf(stderr, "fuzz: inputs %llu accepted %llu\n", g_inputs, g_accepted); });
  return 0;
}

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  if (seed % 2 == 0) {
    const fulcrum::fuzz::Bytes other = TheTarget().Mutate({data, size}, seed);
    if (!other.empty() && other.size() <= most) {
      std::copy(other.begin(), other.end(), data);
      return other.size();
    }
  }
  return LLVMFuzzerMutate(data, size, most);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    ++g_inputs;
    g_accepted += TheTarget().Offer({data, size}) == Outcome::kAccepted ? 1 : 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fuzz: broken: %s\n", error.what());
    std::abort();
  }
  return 0;
}
