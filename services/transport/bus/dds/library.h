// Settings of the library for the whole process, made before its first participant.
#pragma once

#include <cstdint>

namespace fulcrum::bus {

inline constexpr std::uint32_t kMilli_ns = 1'000'000;  ///< Nanoseconds per millisecond, for the library's Duration_t.

}  // namespace fulcrum::bus

namespace fulcrum::bus::dds {

/// Disregards settings from the environment and from profile files, which would silently replace ours, and applies
/// ours.
void PrepareLibrary();

}  // namespace fulcrum::bus::dds
