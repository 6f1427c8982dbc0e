// What scene_compiler does: compile a description, or show what scenes there are and what they hold.
#pragma once

#include "services/apps/scene_compiler/arguments.h"

namespace fulcrum::scene_compiler {

/// Results go to standard output, progress to standard error. Throws InputError, and MismatchError when a compiled
/// scene is of another version.
void Run(const Arguments& arguments);

}  // namespace fulcrum::scene_compiler
