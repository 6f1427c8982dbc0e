// The commands of scene_compiler: compile a description, print a compiled scene, list the scenes of a folder.
#pragma once

#include "services/apps/scene_compiler/arguments.h"

namespace fulcrum::scene_compiler {

/// Executes the command. Results go to standard output, progress to standard error. Throws InputError, and
/// MismatchError when a compiled scene is of another version.
void Run(const Arguments& arguments);

}  // namespace fulcrum::scene_compiler
