// The messages of a recording, sorted by log time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "services/records/recording/mcap_reader.h"

namespace fulcrum::recording {

/// Chunks of a recording overlap in time: large and small topics have separate chunks. A message is held until no later
/// one in the file can be older: a recorder receives a message up to a second after its log time (a late joiner gets
/// what was sent before it), and writes it within half a second, or somewhat more on a busy machine.
class TimeOrder {
 public:
  /// Opens a recording as McapReader does.
  explicit TimeOrder(const std::filesystem::path& file) : reader_(file) {}

  /// Reads the next message by log time; messages of equal time in the order of the file. False at the end.
  bool Next(McapMessage* message);

  [[nodiscard]] const McapReader& reader() const { return reader_; }
  [[nodiscard]] McapReader& reader() { return reader_; }

  static constexpr std::uint64_t kSettle_ns = 2'000'000'000;

 private:
  struct Held {
    McapMessage message{};
    std::vector<std::uint8_t> data;
  };

  McapReader reader_;
  std::multimap<std::uint64_t, Held> held_;  ///< By log time.
  Held given_;
  std::uint64_t newest_ns_ = 0;
  bool ended_ = false;
};

}  // namespace fulcrum::recording
