// What a recorder node is asked to do: its command line, checked, and what a file tells of the session.
#pragma once

#include "services/nodes/app/node_app.h"
#include "services/records/recorder/recorder.h"

namespace fulcrum::recorder {

/// Takes --file and --keep from the options of `app`. `describe` is left to whoever knows the bus. Throws InputError
/// when a value is unusable or neither option was given.
[[nodiscard]] RecorderSettings TakeSettings(app::NodeApp* app);

}  // namespace fulcrum::recorder
