// Threads that share the tasks of a phase. Each thread begins with its own part of them, the same in each phase, so its
// data stay in the cache of its core; then it takes tasks that are left in other parts. Tasks are claimed one by one,
// so a core that the scheduler takes away costs the time of one task. A thread without a task spins for a while, then
// it sleeps. Helpers stay off the core of the calling thread: on one core each would wait for the other. No result
// depends on which thread does a task.
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

  /// Whether the helpers take part in the following runs; otherwise they sleep.
  void EnableHelpers(bool enable) { helpers_enabled_ = enable; }

  /// In the following runs each thread does its part in the opposite order, or in that of the tasks: a phase begins
  /// best with the data that the one before it has ended with, which are still in the cache.
  void AlternateOrder() { backwards_ = !backwards_; }
  void UseForwardOrder() { backwards_ = false; }

  /// body(task, worker) once for each task in [0, tasks), worker in [0, count()); returns when all are done. The first
  /// `split` tasks are of one kind, the others of another: each worker's part has its share of both. The last
  /// `side_tasks` of them are in no part: helpers take them first, the calling thread, which does the serial code
  /// alone, takes them last. At most 65,535 tasks. Not from within a body.
  template <class Body>
  void Run(int tasks, int split, int side_tasks, const Body& body) {
    if (threads_.empty() || !helpers_enabled_ || tasks < 2) {
      const int shared = tasks - side_tasks;
      for (int i = 0; i < tasks; ++i) {
        body(backwards_ && i < shared ? shared - 1 - i : i, 0);
      }
      return;
    }
    RunShared(
        tasks, split, side_tasks,
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
  void RunShared(int tasks, int split, int side_tasks, Call call, const void* body);
  /// Does tasks of the phase until none is left.
  void DoTasks(int worker);
  /// Does tasks of one part.
  void DoTasksOf(int part, int worker);
  void Loop(int worker);

  /// Phase number, end and next task of a part in one word (32, 16, 16 bits): the phase number keeps a late claim from
  /// taking a task of the next phase.
  struct alignas(64) Ticket {
    std::atomic<std::uint64_t> word{0};
  };
  std::vector<Ticket> tickets_;            ///< By worker; the last one: side tasks.
  std::atomic<int> shared_{0}, split_{0};  ///< Tasks that are no side tasks; those of the first kind.
  std::atomic<Call> call_{nullptr};
  std::atomic<const void*> body_{nullptr};
  alignas(64) std::atomic<int> done_{0};
  alignas(64) std::atomic<std::uint32_t> phase_{0};
  std::atomic<int> caller_cpu_{-1};  ///< On which the phase was begun.
  std::atomic<bool> stop_{false};
  std::atomic<bool> backwards_{false};
  bool helpers_enabled_ = true;  ///< Of the thread that calls.
  std::vector<std::thread> threads_;
};

}  // namespace fulcrum::physics::implicit
