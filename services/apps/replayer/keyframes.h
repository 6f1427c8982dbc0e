// Going back in a replay: a copy of the whole process, asleep, for each second of the session.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace fulcrum::replay {

/// A keyframe is a forked process: whatever the nodes consist of, it is kept to the last bit, and memory is shared
/// until it changes. To go back, the nearest keyframe before the wanted time is woken and goes on in the place of the
/// process that woke it. Needs a process with one thread.
class Keyframes {
 public:
  /// Runs `body` in a child, which may make keyframes, and returns the exit code of the line of processes that it
  /// becomes. The caller stays behind and computes nothing.
  static int Run(const std::function<int(Keyframes*)>& body);

  /// Keeps this moment. In the running process returns nothing; when the moment is gone back to, returns the time that
  /// was wanted, in a new process.
  std::optional<double> Keep(double time_s);
  /// Wakes the newest keyframe at or before `time_s`, and this process ends. Returns only when there is none.
  void GoBack(double time_s);

  /// So many are kept; then every second one is let go.
  static constexpr std::size_t kMost = 32;
  [[nodiscard]] double spacing_s() const { return spacing_s_; }

 private:
  struct Keyframe {
    double time_s;
    int wake;  ///< Write end of the pipe that it waits on.
  };
  Keyframes(int lifeline, int verdict) : lifeline_(lifeline), verdict_(verdict) {}

  void Tell(int kind, int value) const;

  std::vector<Keyframe> kept_;  ///< By time.
  double spacing_s_ = 1;
  int lifeline_;  ///< Ends when the caller of Run() does.
  int verdict_;   ///< Where the exit code goes.
};

}  // namespace fulcrum::replay
