// How long a node may take to end: known to the node, which then ends itself, and to the supervisor, which waits.
#pragma once

#include "services/base/core/messages.h"

namespace fulcrum::app {

/// Longest time from the request to stop until the process has ended [s]. A node that takes longer hangs; killing it is
/// safe for its checkpoint. The recorder first writes what waits for the disk, and a dump that has begun: a disk that
/// stands still or is slow must not cost the end of the recording.
[[nodiscard]] constexpr int LongestEnd_s(NodeId node) { return node == NodeId::kRecorder ? 30 : 3; }

}  // namespace fulcrum::app
