#include "services/base/runtime/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fulcrum::runtime {
namespace {

constexpr int kLinearBits = 4;  // 16 linear bins per power of two.

// Values below 16 have a bin of their own; above, the exponent picks the group and the next four bits the bin.
int BinOf(std::uint64_t ns) noexcept {
  if (ns < 16) return static_cast<int>(ns);
  const int exponent = std::bit_width(ns) - 1;
  const int group = exponent - kLinearBits + 1;
  const int linear = static_cast<int>((ns >> (exponent - kLinearBits)) & 15u);
  return std::min(16 * group + linear, kHistogramBins - 1);
}

std::int64_t UpperEdge(int bin) {
  if (bin < 16) return bin;
  const int shift = bin / 16 - 1;
  return ((std::int64_t{16} + bin % 16 + 1) << shift) - 1;
}

}  // namespace

void Histogram::Add(std::int64_t ns) noexcept {
  const std::int64_t value = std::max<std::int64_t>(ns, 0);
  auto& bin = bins_[static_cast<std::size_t>(BinOf(static_cast<std::uint64_t>(value)))];
  // One writer: a relaxed load and store is enough and cheaper than a locked add. Readers want no order between bins.
  bin.store(bin.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  if (value > max_ns_.load(std::memory_order_relaxed)) max_ns_.store(value, std::memory_order_relaxed);
}

HistogramSnapshot Histogram::snapshot() const {
  HistogramSnapshot result;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    result.bins[i] = bins_[i].load(std::memory_order_relaxed);
    result.count += result.bins[i];
  }
  result.max_ns = max_ns_.load(std::memory_order_relaxed);
  return result;
}

std::int64_t HistogramSnapshot::Quantile(double q) const {
  if (count == 0) return 0;
  const double rank = std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count));
  const std::uint64_t wanted = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rank));
  std::uint64_t seen = 0;
  for (int bin = 0; bin < kHistogramBins; ++bin) {
    seen += bins[static_cast<std::size_t>(bin)];
    if (seen >= wanted) return std::min(UpperEdge(bin), max_ns);
  }
  return max_ns;
}

}  // namespace fulcrum::runtime
