// libFuzzer target: any bytes through framer, gates, channels and estimator.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/handle/protocol_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fulcrum::handle_bridge;
  if (!CheckProtocol({reinterpret_cast<const char*>(data), size}).broken.empty()) {
    std::abort();
  }
  return 0;
}
