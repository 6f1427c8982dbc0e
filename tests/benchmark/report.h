// What every benchmark program shares: its command line and its lines `key value unit`.
//
//   bench_NAME [--quick] [PREFIX]
//
// Keys are area.case.figure. A case whose keys all fall outside PREFIX should not run: ask Wants() first. Only result
// lines go to stdout; everything for people goes to stderr.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::benchmark {

class Report {
 public:
  Report(int argc, char** argv);

  [[nodiscard]] bool quick() const { return quick_; }
  /// True when a key that begins with `stem` can match the prefix asked for.
  [[nodiscard]] bool Wants(std::string_view stem) const;
  /// Prints `key value unit` when the key matches the prefix.
  void Add(std::string_view key, double value, std::string_view unit);

 private:
  bool quick_ = false;
  std::string prefix_;
};

/// Quantile of a sample, linear between order statistics. Empty: NaN.
[[nodiscard]] double Quantile(std::vector<double> values, double q);

/// Wall time of `body` in ms, `repeats` times after `warmup` runs.
[[nodiscard]] std::vector<double> TimeMs(int warmup, int repeats, const std::function<void()>& body);

/// Keeps a result alive that nothing reads.
template <class T>
inline void DoNotOptimise(const T& value) {
  asm volatile("" : : "r,m"(value) : "memory");
}

}  // namespace fulcrum::benchmark
