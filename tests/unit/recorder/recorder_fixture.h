// Sends samples to a recorder and reads its files.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/records/recorder/recorder.h"
#include "services/records/recording/mcap_reader.h"

namespace fulcrum::recorder {
namespace fs = std::filesystem;
using recording::McapMessage;
using recording::McapReader;

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::array<std::byte, 4> kHead{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};

struct Read {
  std::uint16_t channel;
  std::uint32_t sequence;
  std::size_t size;
  std::uint64_t log_time_ns, publish_time_ns;
};

class RecorderTest : public testing::Test {
 protected:
  RecorderTest() { fs::create_directory(folder_); }
  ~RecorderTest() override { fs::remove_all(folder_); }

  RecorderSettings Settings() const {
    RecorderSettings settings;
    settings.file = folder_ / "recording.mcap";
    settings.library = "test";
    settings.metadata = {{"session", {{"scene", "small"}}}};
    settings.describe = [](const bus::WriterGuid& writer) {
      return recording::TextMap{{"node", "node " + std::to_string(writer[0])}};
    };
    return settings;
  }
  /// Sends a sample of `size` bytes, encapsulation included, at `now_ns`.
  static void Send(Recorder* recorder, TopicId topic, std::uint8_t writer, std::uint64_t sequence,
                   std::size_t size = 40, std::int64_t now_ns = 0) {
    const std::vector<std::byte> body(size - kHead.size(), static_cast<std::byte>(sequence));
    bus::RawSample sample{topic, {writer}, sequence, 1000 + now_ns, now_ns, kHead, body};
    recorder->Receive(sample);
  }
  static std::vector<Read> ReadAll(McapReader* reader) {
    std::vector<Read> all;
    McapMessage m;
    while (reader->Next(&m)) all.push_back({m.channel, m.sequence, m.data.size(), m.log_time_ns, m.publish_time_ns});
    return all;
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("recorder_" + std::to_string(getpid()));
};

}  // namespace fulcrum::recorder
