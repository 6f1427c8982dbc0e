// The dumps of a recorder: requested on one thread, written on another.
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
  /// `recorder` must outlive the object. @param folder folder of the dumps: dump.mcap, dump-2.mcap …
  DumpWriter(Recorder* recorder, std::filesystem::path folder);

  /// Requests a dump: the next WriteIfAsked writes one, with the last reason given before it. Returns the reply to the
  /// command. May be called on any thread.
  std::string Ask(std::string reason);

  /// Writes a requested dump. The file, or the reason why it could not be written, is logged; nothing is thrown, so
  /// that recording continues. To be called on the recorder's writing thread.
  void WriteIfAsked(std::int64_t now_ns);

 private:
  [[nodiscard]] std::optional<std::string> TakeReason();

  Recorder* recorder_;
  const std::filesystem::path folder_;
  std::mutex mutex_;  ///< Guards `reason_`.
  std::optional<std::string> reason_;
};

}  // namespace fulcrum::recorder
