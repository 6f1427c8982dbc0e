#include "services/apps/replayer/live_run.h"

#include <cstdio>

#include "services/base/core/exit_code.h"
#include "services/base/runtime/realtime.h"

namespace fulcrum::replay {

int RunLive(const LiveSettings& settings) {
  runtime::InstallStopSignals();
  const LiveResult result = ReplayLive(settings, [] { return runtime::ShouldStop(); });
  std::printf("published %llu messages, at most %.1f ms late; %llu could not be sent, %llu could not be read\n",
              static_cast<unsigned long long>(result.published), 1e3 * result.latest_s,
              static_cast<unsigned long long>(result.failed), static_cast<unsigned long long>(result.undecodable));
  return static_cast<int>(result.published > 0 ? ExitCode::kDone : ExitCode::kFailure);
}

}  // namespace fulcrum::replay
