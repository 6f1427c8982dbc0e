// libFuzzer target: any bytes as patches over contact models; begin with the files of corpus/.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/haptics/gate_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (!fulcrum::haptics::testing::Survives({data, size})) std::abort();
  return 0;
}
