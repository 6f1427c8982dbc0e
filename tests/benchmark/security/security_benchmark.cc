// A secured cart: who gets in, and what it costs to join.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <thread>
#include <vector>

#include "services/bus/dds/participant.h"
#include "services/bus/dds/shared_memory.h"
#include "services/keys/key_folder.h"
#include "tests/benchmark/report.h"
#include "tests/support/intruder.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

constexpr int kDomain = 74;

void Attempts(benchmark::Report* report, const fs::path& scratch) {
  int refused = 0, all = 0;
  for (const testing::Attempt& attempt : testing::TryAllAttempts(kDomain, scratch)) {
    ++all;
    refused += attempt.refused() ? 1 : 0;
    std::fprintf(stderr, "%s %s\n", attempt.refused() ? "refused " : "NOT REFUSED", attempt.name.c_str());
  }
  report->Add("security.refused", 100.0 * refused / all, "%");
  report->Add("security.attempts", all, "");
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  if (!report.Wants("security.")) return 0;
  const fs::path scratch = fs::temp_directory_path() / ("fulcrum-bench-security-" + std::to_string(::getpid()));
  fs::create_directories(scratch);
  Attempts(&report, scratch);
  fs::remove_all(scratch);
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
  return 0;
}
