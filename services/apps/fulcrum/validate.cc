// fulcrum validate: the models against theory, experiments and other solvers. The program `validate` contains the
// models and executes it.
#include "services/apps/fulcrum/commands.h"

namespace fulcrum::supervisor::cli {

ExitCode Validate(const Words& words) {
  Words command{"validate"};
  command.insert(command.end(), words.begin(), words.end());
  Become(command);
}

}  // namespace fulcrum::supervisor::cli
