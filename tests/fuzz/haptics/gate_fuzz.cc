// libFuzzer target: the input is a list of patches (place, length, bytes) over valid contact models, one each tick.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/haptics/gate_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using fulcrum::haptics::testing::GateCheck;
  GateCheck check;
  for (int i = 0; i < 300; ++i) {
    if (!check.Offer(check.Good())) std::abort();
  }
  std::span<const std::uint8_t> rest(data, size);
  while (rest.size() >= 3) {
    const std::size_t at = rest[0] + 256u * rest[1];
    const std::size_t length = std::min<std::size_t>(rest[2] % 32u, rest.size() - 3);
    fulcrum::ContactModel model = check.Good();
    GateCheck::Apply({at, rest.subspan(3, length)}, &model);
    if (!check.Offer(model)) std::abort();
    rest = rest.subspan(3 + length);
  }
  return 0;
}
