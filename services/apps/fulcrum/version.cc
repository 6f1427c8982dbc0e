#include "services/nodes/app/version.h"

#include <cstdio>

#include "services/apps/fulcrum/commands.h"

namespace fulcrum::supervisor::cli {

ExitCode Version(const Words& words) {
  if (!Parse("version", words, {}).help) {
    std::printf("fulcrum %s\n", app::kVersion);
  }
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
