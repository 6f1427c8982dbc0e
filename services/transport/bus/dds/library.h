// What holds for the whole library in a process, before its first participant.
#pragma once

#include <cstdint>

namespace fulcrum::bus {

inline constexpr std::uint32_t kMilli_ns = 1'000'000;  ///< Of the library's Duration_t.

}  // namespace fulcrum::bus

namespace fulcrum::bus::dds {

/// Disregards settings from outside, which would silently replace the ones that were measured, and sets ours.
void PrepareLibrary();

}  // namespace fulcrum::bus::dds
