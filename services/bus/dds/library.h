// What holds for the whole library in a process, before its first participant.
#pragma once

namespace fulcrum::bus::dds {

/// Disregards settings from outside, which would silently replace the ones that were measured, and sets ours.
void PrepareLibrary();

}  // namespace fulcrum::bus::dds
