// Progress of a replay on a terminal. Internal to services/apps/replayer.
#pragma once

#include <cstdio>
#include <functional>
#include <stdexcept>

#include "services/base/runtime/realtime.h"

namespace fulcrum::replay {

/// One line on standard error that each call overwrites.
class ProgressLine {
 public:
  /// @param quiet true: prints nothing.
  explicit ProgressLine(bool quiet) : quiet_(quiet) {}

  /// Function that a replay calls with the session time [s]; empty when quiet.
  [[nodiscard]] std::function<void(double)> callback() const {
    if (quiet_) return {};
    return [](double time_s) { std::fprintf(stderr, "\rsession time %.1f s ", time_s); };
  }
  /// Clears the line; call before the result is printed.
  void Clear() const { std::fputs(quiet_ ? "" : "\r\033[K", stderr); }

 private:
  bool quiet_;
};

/// From now on SIGINT and SIGTERM end a replay through the exception that the returned function throws, so that neither
/// half a file nor a temporary folder remains. The function shows the progress, too.
[[nodiscard]] inline std::function<void(double)> UntilStopped(const ProgressLine& progress) {
  runtime::InstallStopSignals();
  return [show = progress.callback()](double time_s) {
    if (runtime::ShouldStop()) throw std::runtime_error("stopped");
    if (show) show(time_s);
  };
}

}  // namespace fulcrum::replay
