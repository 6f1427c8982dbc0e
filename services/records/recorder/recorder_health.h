// The figures of a recorder in Health.
#pragma once

#include "services/base/core/messages.h"
#include "services/records/recorder/recorder.h"

namespace fulcrum::recorder {

/// Sets the metrics, and after a failure of writing also the state and the last error.
void FillHealth(const RecorderStats& stats, Health* health);

}  // namespace fulcrum::recorder
