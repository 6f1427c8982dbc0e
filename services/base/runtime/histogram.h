// Log-linear histogram of durations, written by one thread without locks or allocation, read by any.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace fulcrum::runtime {

/// 16 linear bins per power of two: at most 6.25 % error of a percentile, from 1 ns to 68 s.
inline constexpr int kHistogramBins = 16 * 33;

struct HistogramSnapshot {
  std::array<std::uint64_t, kHistogramBins> bins{};
  std::uint64_t count = 0;
  std::int64_t max_ns = 0;
  /// Upper edge of the bin that holds quantile q in [0, 1]; 0 when empty [ns].
  [[nodiscard]] std::int64_t Quantile(double q) const;
};

class Histogram {
 public:
  /// Real-time safe; negative values count as 0.
  void Add(std::int64_t ns) noexcept;
  [[nodiscard]] HistogramSnapshot snapshot() const;

 private:
  std::array<std::atomic<std::uint64_t>, kHistogramBins> bins_{};
  std::atomic<std::int64_t> max_ns_{0};
};

}  // namespace fulcrum::runtime
