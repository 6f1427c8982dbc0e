// Pause between two turns of the supervisor's loop.
#pragma once

#include <signal.h>

#include <chrono>
#include <vector>

namespace fulcrum::supervisor {

/// From its construction on, the end of a child process interrupts a wait. One per process.
class LoopWait {
 public:
  LoopWait();
  ~LoopWait();
  LoopWait(const LoopWait&) = delete;
  LoopWait& operator=(const LoopWait&) = delete;

  /// Main thread: waits until one of `descriptors` can be read, a child process ends, a signal arrives, or the time is
  /// over. A child that ends between two waits does not shorten the next one.
  void Wait(const std::vector<int>& descriptors, std::chrono::milliseconds longest) const;

 private:
  struct sigaction before_ {};
};

}  // namespace fulcrum::supervisor
