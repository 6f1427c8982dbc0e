// Properties that must hold for any bytes in a recording: reading, decoding and repair end without a crash, no read
// exceeds the file's size, and a repaired file is complete and has the same messages.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include "services/base/core/error.h"
#include "services/records/log_tools/recording.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recording/mcap_index.h"

namespace fulcrum::log_tools {

struct RecordingVerdict {
  std::string broken;  ///< Empty: all holds.
  std::uint64_t messages = 0, decoded = 0, faults = 0;
};

/// Files are created in `folder`, preferably in memory: on a disk the speed of the file system would dominate.
inline RecordingVerdict CheckRecording(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "fuzzed.mcap", mended = folder / "mended.mcap";
  std::filesystem::remove(file);
  std::filesystem::remove(mended);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  RecordingVerdict verdict;
  try {
    const auto read = [](const std::filesystem::path& from, RecordingVerdict* counts) {
      Recording recording(from);
      Entry entry;
      while (recording.Next(&entry)) {
        ++counts->messages;
        const bool decoded =
            entry.source->topic && WithDecoded(*entry.source->topic, entry.message.data, [](const auto&) {});
        counts->decoded += decoded ? 1 : 0;
      }
      counts->faults = recording.reader().faults().size();
    };
    read(file, &verdict);
    std::uint64_t indexed = 0;
    (void)recording::CheckIndex(file, &indexed);
    (void)Recover(file, mended);
    RecordingVerdict whole;
    read(mended, &whole);
    if (whole.faults != 0) verdict.broken = "what was mended has faults";
    if (whole.messages != verdict.messages || whole.decoded != verdict.decoded) {
      verdict.broken = "what was mended has other messages: " + std::to_string(whole.messages) + " of " +
                       std::to_string(verdict.messages) + ", of them decoded " + std::to_string(whole.decoded) +
                       " of " + std::to_string(verdict.decoded);
    }
    if (!recording::CheckIndex(mended, &indexed).empty()) verdict.broken = "what was mended has a wrong index";
  } catch (const InputError&) {
    // Reported to the user.
  }
  return verdict;
}

}  // namespace fulcrum::log_tools
