// The program recorder together with a source whose samples are all known.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
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
    std::filesystem::path file;
  };
  /// Records for `seconds`, then kills the recorder and reads its file. `due` is 0 if the recorder did not start.
  Result RecordAndKill(double seconds);

 private:
  struct Sent {
    std::uint64_t sequence;
    std::int64_t time_ns;
  };
  bool Connect(const Program& recorder);
  void SendFor(double seconds);
  static void Count(const std::vector<Sent>& sent, const std::vector<std::uint64_t>& read, std::int64_t kill_ns,
                    Result* result);

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
