// Seeking back in a replay: keyframes are sleeping copies of the whole process, one for each second of the session.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace fulcrum::replay {

/// A keyframe is a forked process: it contains the state of all nodes bit for bit, and shares memory until that
/// changes. To seek back, the nearest keyframe before the requested time is woken and continues in place of the process
/// that woke it. The process must have one thread.
class Keyframes {
 public:
  /// Runs `body` in a child, which may make keyframes, and returns the exit code of the process that ends the replay.
  /// The caller only waits.
  static int Run(const std::function<int(Keyframes*)>& body);

  /// Makes a keyframe. Returns nullopt in the running process, and after a seek back, in a new process, the requested
  /// session time [s].
  std::optional<double> Keep(double time_s);
  /// Wakes the newest keyframe at or before `time_s` and ends this process. Returns only when there is none.
  void GoBack(double time_s);

  /// Largest number of keyframes; when it is reached, every second one is removed.
  static constexpr std::size_t kMost = 32;
  [[nodiscard]] double spacing_s() const { return spacing_s_; }

 private:
  struct Keyframe {
    double time_s;
    int wake;  ///< Write end of the pipe on which it waits.
  };
  Keyframes(int lifeline, int verdict) : lifeline_(lifeline), verdict_(verdict) {}

  void Tell(int kind, int value) const;

  std::vector<Keyframe> kept_;  ///< Sorted by time.
  double spacing_s_ = 1;
  int lifeline_;  ///< Read end of a pipe that closes when the caller of Run() ends.
  int verdict_;   ///< Write end of the pipe for the exit code.
};

}  // namespace fulcrum::replay
