// The messages of a recording by their log times.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "services/records/recording/mcap_reader.h"

namespace fulcrum::recording {

/// Chunks of a recording overlap in time: large topics and small ones have chunks of their own. What has been read is
/// held until nothing that follows can be older: a recorder writes each message within kSettle_ns.
class TimeOrder {
 public:
  /// See McapReader.
  explicit TimeOrder(const std::filesystem::path& file) : reader_(file) {}

  /// The next message by log time; those of one time in the order of the file. False at the end.
  bool Next(McapMessage* message);

  [[nodiscard]] const McapReader& reader() const { return reader_; }
  [[nodiscard]] McapReader& reader() { return reader_; }

  static constexpr std::uint64_t kSettle_ns = 1'000'000'000;

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
