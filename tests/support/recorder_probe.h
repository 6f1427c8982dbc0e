// The program recorder together with a source of known samples.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/support/program.h"

namespace fulcrum::testing {

/// Sends ToolState at 1 kHz and TissueFrame at 100 Hz to a recorder of its own.
class RecorderProbe {
 public:
  explicit RecorderProbe(int domain);
  ~RecorderProbe();
  RecorderProbe(const RecorderProbe&) = delete;
  RecorderProbe& operator=(const RecorderProbe&) = delete;

  struct Result {
    std::uint64_t due = 0;     ///< Samples that the file must contain: those older than a second at the kill.
    std::uint64_t read = 0;    ///< Of these, samples up to the last one of their topic in the file.
    std::uint64_t missed = 0;  ///< Of those, missing samples: lost in transport and not by the kill.
    double unread_ms = 0;      ///< Age of the last ToolState in the file at the kill [ms]: the loss caused by the kill.
    std::filesystem::path file;
  };
  /// Records for `seconds`, then kills the recorder and reads its file. `due` is 0 if the recorder did not start.
  Result RecordAndKill(double seconds);

  struct FullDisk {
    bool has_ended = false;      ///< In order: the file is closed and contains the reason for its end.
    std::uint64_t recorded = 0;  ///< Samples in the file.
    std::uint64_t lost = 0;      ///< Samples sent before the end of the recording that are not in the file.
    std::filesystem::path file;
  };
  /// Records onto a disk with `room_B` of free space above the recorder's reserve, for `seconds`, then stops the
  /// recorder.
  FullDisk RecordUntilFull(std::uint64_t room_B, double seconds);

 private:
  struct Sent {
    std::uint64_t sequence;
    std::int64_t time_ns;
  };
  /// Stamps of a topic's samples in a file, by sequence.
  using Stamps = std::map<std::uint64_t, std::int64_t>;
  struct Content {
    Stamps tools, frames;
    bool closed = false;
    std::string ended;
  };
  [[nodiscard]] static Content Read(const std::filesystem::path& file);
  [[nodiscard]] std::vector<std::string> Arguments(const std::filesystem::path& file) const;
  bool Connect(const Program& recorder);
  void SendFor(double seconds);
  static void Count(const std::vector<Sent>& sent, const Stamps& read, std::int64_t kill_ns, Result* result);
  /// Number of samples that were sent between the first recorded one and `end_ns` and are not in the file.
  static std::uint64_t Missing(const std::vector<Sent>& sent, const Stamps& read, std::int64_t end_ns);

  const int domain_;
  std::filesystem::path folder_, scene_;
  SceneManifest manifest_;
  std::unique_ptr<bus::DdsParticipant> participant_;
  std::unique_ptr<bus::Output<SceneManifest>> manifests_;
  std::unique_ptr<bus::Output<ToolState>> tools_;
  std::unique_ptr<bus::LoanOutput<TissueFrame>> frames_;
  bus::Stamper tool_stamper_, frame_stamper_;
  std::vector<Sent> sent_tools_, sent_frames_;
  int runs_ = 0;
};

}  // namespace fulcrum::testing
