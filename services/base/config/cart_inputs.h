// Section `inputs` of a cart file: what the sticks and buttons of a gamepad and of a SpaceMouse do.
#pragma once

#include "services/base/config/strict_yaml.h"
#include "services/base/core/pad_hands.h"

namespace fulcrum::config {

/// Keys that the file does not contain keep their values. Throws InputError.
void ReadInputs(StrictMap map, InputSettings* inputs);

}  // namespace fulcrum::config
