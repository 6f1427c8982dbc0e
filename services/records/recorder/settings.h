// Settings of a recorder node from its command line, checked, and the metadata of the session.
#pragma once

#include "services/nodes/app/node_app.h"
#include "services/records/recorder/recorder.h"

namespace fulcrum::recorder {

/// Takes --file and --keep from the options of `app`; the caller sets `describe`. Throws InputError if a value is
/// unusable or neither option was given.
[[nodiscard]] RecorderSettings TakeSettings(app::NodeApp* app);

}  // namespace fulcrum::recorder
