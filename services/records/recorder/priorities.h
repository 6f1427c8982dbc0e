// What a recording must contain, and what it can do without.
#pragma once

#include "services/base/core/messages.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::recorder {

/// Frames and patches fill nine tenths of a recording and are read for pictures only; a replay computes them again.
[[nodiscard]] constexpr bool IsLarge(TopicId topic) { return bus::QualityOf(topic).path == bus::Path::kSharedMemory; }

/// Whether a replay does without the topic: its samples are dropped first. All others (inputs, ticks, states, events)
/// have room of their own in the queue.
[[nodiscard]] constexpr bool IsDroppedFirst(TopicId topic) { return IsLarge(topic) || topic == TopicId::kHealth; }

}  // namespace fulcrum::recorder
