// Difference between two byte sequences: only the bytes that differ from a base are encoded, runs of equal bytes are
// skipped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fulcrum::link {

/// Appends `bytes` as the difference from `base`. Beyond the end of `base`, which may be empty, the base is zeros.
void PutDelta(std::span<const std::uint8_t> base, std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>* out);

/// Decodes `delta` against `base`. False if `delta` is malformed or decodes to more than `largest` bytes; the content
/// of `bytes` is then unspecified.
[[nodiscard]] bool TakeDelta(std::span<const std::uint8_t> base, std::span<const std::uint8_t> delta,
                             std::size_t largest, std::vector<std::uint8_t>* bytes);

}  // namespace fulcrum::link
