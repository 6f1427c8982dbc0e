// libFuzzer target: any bytes as a request; begin with the files of corpus/.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/console/route_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fulcrum::console::testing;
  if (!Broken(RequestFrom({reinterpret_cast<const char*>(data), size})).empty()) std::abort();
  return 0;
}
