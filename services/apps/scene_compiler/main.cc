// scene_compiler: compiles a scene description into the file that the nodes map.
#include <iostream>

#include "services/apps/scene_compiler/arguments.h"
#include "services/apps/scene_compiler/commands.h"
#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"

namespace {

using namespace fulcrum;  // NOLINT: a main uses names of other modules only

int Fail(const std::exception& error, ExitCode code) {
  std::cerr << "scene_compiler: " << error.what() << "\n";
  return static_cast<int>(code);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    scene_compiler::Run(scene_compiler::ParseArguments({argv + 1, argv + argc}));
    return static_cast<int>(ExitCode::kDone);
  } catch (const InputError& error) {
    return Fail(error, ExitCode::kBadUsage);
  } catch (const MismatchError& error) {
    return Fail(error, ExitCode::kMismatch);
  } catch (const std::exception& error) {
    return Fail(error, ExitCode::kFailure);
  }
}
