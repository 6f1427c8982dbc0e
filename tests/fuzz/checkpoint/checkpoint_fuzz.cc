// libFuzzer target: any bytes as patches over a good checkpoint; begin with the files of corpus/.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/checkpoint/checkpoint_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto check = FULCRUM_CHECKPOINT_CHECK();
  std::vector<std::byte> payload = check->good();
  fulcrum::testing::Patch({data, size}, &payload);
  if (check->Offer(payload) == fulcrum::testing::Outcome::kBroken) std::abort();
  return 0;
}
