#include "services/transport/link/codec/byte_delta.h"

#include <algorithm>

#include "services/transport/link/codec/bits.h"

namespace fulcrum::link {
namespace {

/// Skipping a run of equal bytes costs two encoded lengths, so shorter runs are encoded with their neighbours.
constexpr std::size_t kShortestSkip = 4;

std::uint8_t At(std::span<const std::uint8_t> base, std::size_t i) { return i < base.size() ? base[i] : 0; }

}  // namespace

void PutDelta(std::span<const std::uint8_t> base, std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>* out) {
  PutVarint(static_cast<std::uint32_t>(bytes.size()), out);
  const auto same_from = [&](std::size_t i) {
    std::size_t end = i;
    while (end < bytes.size() && bytes[end] == At(base, end)) ++end;
    return end - i;
  };
  for (std::size_t i = 0; i < bytes.size();) {
    const std::size_t skip = same_from(i);
    i += skip;
    if (i == bytes.size()) break;
    std::size_t end = i;
    while (end < bytes.size()) {
      const std::size_t same = same_from(end);
      if (same >= kShortestSkip || end + same == bytes.size()) break;
      end += same + 1;
    }
    PutVarint(static_cast<std::uint32_t>(skip), out);
    PutVarint(static_cast<std::uint32_t>(end - i), out);
    out->insert(out->end(), bytes.begin() + static_cast<std::ptrdiff_t>(i),
                bytes.begin() + static_cast<std::ptrdiff_t>(end));
    i = end;
  }
}

bool TakeDelta(std::span<const std::uint8_t> base, std::span<const std::uint8_t> delta, std::size_t largest,
               std::vector<std::uint8_t>* bytes) {
  ByteReader in(delta);
  const std::size_t size = TakeVarint(&in);
  if (!in.good() || size > largest) return false;
  bytes->assign(base.begin(), base.begin() + static_cast<std::ptrdiff_t>(std::min(size, base.size())));
  bytes->resize(size, 0);
  for (std::size_t at = 0; !in.empty();) {
    const std::size_t skip = TakeVarint(&in), count = TakeVarint(&in);
    if (!in.good() || skip > size - at || count > size - at - skip) return false;
    at += skip;
    const std::span<const std::uint8_t> literal = in.Take(count);
    if (!in.good()) return false;
    std::copy(literal.begin(), literal.end(), bytes->begin() + static_cast<std::ptrdiff_t>(at));
    at += count;
  }
  return true;
}

}  // namespace fulcrum::link
