// The dumps of a recorder: asked for on one thread, written on another.
#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>

#include "services/records/recorder/recorder.h"

namespace fulcrum::recorder {

class DumpWriter {
 public:
  /// `recorder` must outlive it. @param folder of the dumps: dump.mcap, dump-2.mcap …
  DumpWriter(Recorder* recorder, std::filesystem::path folder);

  /// The next WriteIfAsked writes one dump, with the last reason given before it. Returns the reply to the command. Any
  /// thread.
  std::string Ask(std::string reason);

  /// Logs what it wrote, or why it could not, and does not throw: recording goes on. The writing thread of the
  /// recorder.
  void WriteIfAsked(std::int64_t now_ns);

 private:
  [[nodiscard]] std::optional<std::string> TakeReason();

  Recorder* recorder_;
  const std::filesystem::path folder_;
  std::mutex mutex_;  ///< Guards `reason_`.
  std::optional<std::string> reason_;
};

}  // namespace fulcrum::recorder
