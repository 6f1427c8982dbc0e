// Command line and output lines `key value unit` of all benchmark programs.
//
//   bench_NAME [--quick] [PREFIX]
//
// Keys are area.case.figure. A case without a key below PREFIX should not run: check Wants() first. Only result lines
// are written to stdout; everything else to stderr.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/quantile.h"

namespace fulcrum::benchmark {

class Report {
 public:
  Report(int argc, char** argv);

  [[nodiscard]] bool quick() const { return quick_; }
  /// True when a key that begins with `stem` can match the requested prefix.
  [[nodiscard]] bool Wants(std::string_view stem) const;
  /// Prints `key value unit` when the key matches the prefix.
  void Add(std::string_view key, double value, std::string_view unit);

 private:
  bool quick_ = false;
  std::string prefix_;
};

/// Wall time of `body` in ms, `repeats` times after `warmup` runs.
[[nodiscard]] std::vector<double> TimeMs(int warmup, int repeats, const std::function<void()>& body);

/// Keeps the compiler from removing an unused result.
template <class T>
inline void DoNotOptimise(const T& value) {
  asm volatile("" : : "r,m"(value) : "memory");
}

}  // namespace fulcrum::benchmark
