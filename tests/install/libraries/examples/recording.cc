// Writes a recording of a thousand messages and reads it back.
#include <array>
#include <cstdio>
#include <cstring>

#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"

int main() {
  using namespace fulcrum::recording;
  constexpr std::uint32_t kMessages = 1000;
  {
    McapWriter writer("example.mcap", "", "example");
    const std::uint16_t channel = writer.AddChannel(0, "example/counter", "raw", {{"unit", "1"}});
    for (std::uint32_t i = 0; i < kMessages; ++i) {
      std::array<std::byte, sizeof i> data;
      std::memcpy(data.data(), &i, sizeof i);
      writer.Write(channel, i, 1000 * i, 1000 * i, data);
    }
    writer.Close();
    if (!writer.error().empty()) {
      std::printf("%s\n", writer.error().c_str());
      return 1;
    }
  }
  McapReader reader("example.mcap");
  std::uint32_t count = 0, in_order = 0;
  for (McapMessage message; reader.Next(&message); ++count) {
    std::uint32_t value = 0;
    std::memcpy(&value, message.data.data(), sizeof value);
    in_order += value == count ? 1 : 0;
  }
  std::printf("%u messages, %u in order, closed: %s\n", count, in_order, reader.closed() ? "yes" : "no");
  return count == kMessages && in_order == kMessages ? 0 : 1;
}
