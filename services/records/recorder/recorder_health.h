// What a recorder tells of itself in Health.
#pragma once

#include "services/base/core/messages.h"
#include "services/records/recorder/recorder.h"

namespace fulcrum::recorder {

/// Metrics; after writing has failed also the state and the last error.
void FillHealth(const RecorderStats& stats, Health* health);

}  // namespace fulcrum::recorder
