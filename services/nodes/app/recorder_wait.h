// The first samples must not pass the recorder by: a replay could not begin without them.
#pragma once

#include "services/transport/bus/dds/participant.h"

namespace fulcrum::app {

/// Waits until the recorder of a recorded session reads what this process writes. Counts looks instead of time: each
/// look proves that this process was given time.
class RecorderWait {
 public:
  /// One look. True: the node may begin in a recorded session.
  [[nodiscard]] bool Look(const bus::DdsParticipant& participant, bool session_is_known) {
    looks_ += session_is_known ? 1 : 0;
    looks_read_ += participant.IsReadBy(bus::kRecorderPeer) ? 1 : 0;
    return heard() || looks_ > kForReaders || (looks_ > kForRecorder && !participant.Knows(bus::kRecorderPeer));
  }
  /// Its readers have had time to see the writers of this process.
  [[nodiscard]] bool heard() const { return looks_read_ > kAfterReaders; }

 private:
  /// A recorder is found within so many looks of the session's first, or is gone. (With ten, one start in a hundred did
  /// not find it while other nodes were killed.)
  static constexpr int kForRecorder = 30;
  /// A recorder that stands still holds up a node for so many looks at most.
  static constexpr int kForReaders = 50;
  /// Its readers have seen our writers so many looks after we have seen them.
  static constexpr int kAfterReaders = 3;

  int looks_ = 0, looks_read_ = 0;
};

}  // namespace fulcrum::app
