// Bytes told by what differs from others that the reader has already: runs that are the same are skipped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fulcrum::link {

/// Appends `bytes`, told from `base`; beyond its end, and without one, the base is zeros.
void PutDelta(std::span<const std::uint8_t> base, std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>* out);

/// False when `delta` is none, or tells of more than `largest` bytes; `bytes` is then anything.
[[nodiscard]] bool TakeDelta(std::span<const std::uint8_t> base, std::span<const std::uint8_t> delta,
                             std::size_t largest, std::vector<std::uint8_t>* bytes);

}  // namespace fulcrum::link
