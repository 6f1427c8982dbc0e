// libFuzzer target: any bytes as a recording; begin with the files of corpus/.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tests/fuzz/recording/recording_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = [] {
    const std::filesystem::path made = "/dev/shm/fulcrum-recording-fuzz-" + std::to_string(getpid());
    std::filesystem::create_directories(made);
    return made;
  }();
  if (!fulcrum::log_tools::CheckRecording({data, size}, folder).broken.empty()) std::abort();
  return 0;
}
