#include "tests/benchmark/report.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace fulcrum::benchmark {

Report::Report(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view arg = argv[i];
    if (arg == "--quick") {
      quick_ = true;
    } else if (arg.starts_with("-")) {
      std::fprintf(stderr, "usage: %s [--quick] [PREFIX]\n", argv[0]);
      std::exit(arg == "--help" || arg == "-h" ? 0 : 2);
    } else {
      prefix_ = arg;
    }
  }
}

bool Report::Wants(std::string_view stem) const {
  return stem.starts_with(prefix_) || std::string_view(prefix_).starts_with(stem);
}

void Report::Add(std::string_view key, double value, std::string_view unit) {
  if (!key.starts_with(prefix_)) return;
  std::printf("%.*s %.6g %.*s\n", static_cast<int>(key.size()), key.data(), value, static_cast<int>(unit.size()),
              unit.data());
  std::fflush(stdout);
}

std::vector<double> TimeMs(int warmup, int repeats, const std::function<void()>& body) {
  std::vector<double> times;
  for (int i = 0; i < warmup + repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    body();
    const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - start;
    if (i >= warmup) times.push_back(elapsed.count());
  }
  return times;
}

}  // namespace fulcrum::benchmark
