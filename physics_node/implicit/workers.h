// Threads that share the tasks of a phase. Each begins with its own part of them, the same in each phase, so that data
// stay in the cache of its core; then it takes what others have left. Tasks are claimed one by one, so that a thread
// whose core is taken away costs the time of its task and no more; whoever finds nothing to do spins for a while and
// then sleeps. The other threads keep off the core of the one that calls: on one core each waits for the other. Which
// thread does a task must not matter to its result.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace fulcrum::physics::implicit {

class Workers {
 public:
  /// `threads` with the one that calls; at least 1.
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  [[nodiscard]] int count() const { return static_cast<int>(tickets_.size()) - 1; }

  /// Whether the other threads help in what is run from now on; else they sleep. What comes out does not depend on it.
  void LetHelp(bool help) { help_ = help; }

  /// Each thread does its part in the other order, or in that of the tasks, in what is run from now on: that with which
  /// a phase begins is best what the one before it has ended with, for that is still in the cache of its core.
  void Turn() { backwards_ = !backwards_; }
  void TurnForward() { backwards_ = false; }

  /// body(task, worker) once for each task in [0, tasks), worker in [0, count()); returns when all are done. The first
  /// `split` tasks are of one kind, the others of another: each worker's part has its share of both. The last
  /// `errands` of them are nobody's part: the thread that calls, which has the serial stretches to itself, takes them
  /// last, the others first. At most 65,535 tasks. Not from within a body.
  template <class Body>
  void Run(int tasks, int split, int errands, const Body& body) {
    if (threads_.empty() || !help_ || tasks < 2) {
      const int shared = tasks - errands;
      for (int i = 0; i < tasks; ++i) {
        body(backwards_ && i < shared ? shared - 1 - i : i, 0);
      }
      return;
    }
    RunShared(
        tasks, split, errands,
        [](const void* b, int task, int worker) { (*static_cast<const Body*>(b))(task, worker); }, &body);
  }
  template <class Body>
  void Run(int tasks, int split, const Body& body) {
    Run(tasks, split, 0, body);
  }

 private:
  using Call = void (*)(const void* body, int task, int worker);

  /// First of `tasks` in a worker's part.
  [[nodiscard]] int First(int tasks, int worker) const { return tasks * worker / count(); }
  void RunShared(int tasks, int split, int errands, Call call, const void* body);
  /// Does tasks of the phase until none is left.
  void Help(int worker);
  /// Does tasks of one part.
  void HelpPart(int part, int worker);
  void Loop(int worker);

  /// Phase number, tasks and next task of a part in one word (32, 16, 16 bits): a claim cannot mistake one phase for
  /// another.
  struct alignas(64) Ticket {
    std::atomic<std::uint64_t> word{0};
  };
  std::vector<Ticket> tickets_;            ///< By worker; the last one: errands.
  std::atomic<int> shared_{0}, split_{0};  ///< Tasks that are no errands; the first kind of them.
  std::atomic<Call> call_{nullptr};
  std::atomic<const void*> body_{nullptr};
  alignas(64) std::atomic<int> done_{0};
  alignas(64) std::atomic<std::uint32_t> phase_{0};
  std::atomic<int> caller_cpu_{-1};  ///< That the phase was begun on.
  std::atomic<bool> stop_{false};
  std::atomic<bool> backwards_{false};
  bool help_ = true;  ///< Of the thread that calls.
  std::vector<std::thread> threads_;
};

}  // namespace fulcrum::physics::implicit
