// Events of attempts, for the time line of their replay, read from their recordings.
#pragma once

#include <filesystem>
#include <future>
#include <list>
#include <stop_token>
#include <string>

namespace fulcrum::console {

/// A recording has gigabytes: each is read once, in a thread of its own with low priority, and the newest results stay
/// in memory.
class AttemptEvents {
 public:
  static constexpr std::size_t kMostKept = 32;
  static constexpr int kMostReading = 2;  ///< The attempt and its demonstration.

  AttemptEvents() = default;
  /// Ends the reading.
  ~AttemptEvents();
  AttemptEvents(const AttemptEvents&) = delete;
  AttemptEvents& operator=(const AttemptEvents&) = delete;

  /// Events of the session in a folder: `ready` (false: ask again), `why` (reason why there are none), `events` (list
  /// of `t`, `until` [s of session time], `kind`, `text`), `left_out`.
  [[nodiscard]] std::string JsonOf(const std::filesystem::path& folder);

 private:
  struct Reading {
    std::filesystem::path folder;
    std::shared_future<std::string> json;
  };
  std::list<Reading> readings_;  ///< Newest first.
  std::stop_source stop_;
};

}  // namespace fulcrum::console
