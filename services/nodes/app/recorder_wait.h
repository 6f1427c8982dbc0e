// The first samples of a node in a recorded session must be in the recording: a replay could not begin without them.
#pragma once

#include <cstdint>
#include <memory>

#include "services/base/core/tick.h"
#include "services/transport/bus/dds/participant.h"

namespace fulcrum::app {

/// Waits until the recorder reports that it reads all writers of this process.
class RecorderWait {
 public:
  /// To be constructed after all outputs of the process have been made.
  explicit RecorderWait(bus::DdsParticipant* participant)
      : participant_(participant),
        metric_(bus::kReadsMetric + participant->address()),
        healths_(participant->MakeInput<Health>()) {}

  /// @param session_is_known the process has received a SceneManifest.
  void Update(std::int64_t now_ns, bool session_is_known) {
    if (session_is_known && known_ns_ == 0) known_ns_ = now_ns;
    while (healths_->TakeNext(&health_)) {
      if (health_.node != NodeId::kRecorder) continue;
      for (const Metric& metric : health_.metrics) {
        is_listed_ |= metric.name == metric_ && metric.value >= participant_->writer_count();
      }
    }
    is_read_ = is_listed_ && participant_->IsReadBy(bus::kRecorderPeer);
    const std::int64_t waited_ns = known_ns_ == 0 ? 0 : now_ns - known_ns_;
    is_over_ = is_read_ || waited_ns > kLongestWait_ns ||
               (waited_ns > kLongestDiscovery_ns && !participant_->HasParticipant(bus::kRecorderPeer));
  }
  [[nodiscard]] bool is_read() const { return is_read_; }
  /// The node may begin: it is read, or no recorder will read it.
  [[nodiscard]] bool is_over() const { return is_over_; }

 private:
  /// A recorder on this bus is discovered within this time of the first SceneManifest, or there is none: it has ended,
  /// or it records on the other side of a link.
  static constexpr std::int64_t kLongestDiscovery_ns = kSecond_ns / 2;
  /// A recorder that does not report holds up a node no longer than this.
  static constexpr std::int64_t kLongestWait_ns = 3 * kSecond_ns;

  bus::DdsParticipant* participant_;
  const std::string metric_;
  std::unique_ptr<bus::Input<Health>> healths_;
  Health health_;  ///< Reused.
  std::int64_t known_ns_ = 0;
  bool is_listed_ = false, is_read_ = false, is_over_ = false;
};

}  // namespace fulcrum::app
