// Observation of a cart on its bus: a separate thread reads all topics each millisecond and checks the samples.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "services/base/core/messages.h"
#include "tests/support/force_judge.h"

namespace fulcrum::testing {

/// Observed state of a cart. Times are CLOCK_MONOTONIC [ns].
struct CartState {
  /// Newest process of a node, from its first useful sample on: a jaw angle, a tool, a frame, the topology, a picture.
  struct Voice {
    std::uint64_t epoch = 0;
    std::int64_t heard_ns = 0;
  };
  std::array<Voice, kNodeCount> voices;
  std::map<NodeId, Health> healths;
  std::vector<ForceJudge> judges;  ///< One per tool.

  TissueFrameHeader frame;
  /// Largest simulated time that was lost at a restart of physics [s]. A lost step counts.
  double tissue_lost_s = 0;

  TopologyState topology;
  /// Number of revisions and dead edges that are missing in a later TopologyState.
  std::uint64_t topology_lost = 0;

  /// Newest checkpoint of a node, and the last time at which it did not exist yet.
  struct Seal {
    std::uint64_t sequence = 0;
    std::int64_t before_ns = 0;
  };
  std::map<NodeId, Seal> seals;

  std::array<std::uint64_t, kTopicCount> rejected{};  ///< Samples dropped by the gate, by topic.
  [[nodiscard]] double Metric(NodeId node, const std::string& name) const;
  [[nodiscard]] double peak_force_N() const;
  [[nodiscard]] double peak_step_N() const;
  /// First violation of the force limits; empty if there is none.
  [[nodiscard]] std::string force_verdict() const;
};

class CartWatch {
 public:
  /// @param scene YAML, for the tools' trocars.
  /// @param session folder with the checkpoints; it may be created later.
  CartWatch(int domain, const std::filesystem::path& scene, const std::filesystem::path& session);
  ~CartWatch();
  CartWatch(const CartWatch&) = delete;
  CartWatch& operator=(const CartWatch&) = delete;

  /// Ignores further samples with this epoch, which is not the cart's.
  void Ignore(std::uint64_t epoch);
  /// Calls `look` with the present state, under the lock, and returns its result.
  template <class Look>
  auto See(const Look& look) {
    const std::lock_guard lock(mutex_);
    return look(static_cast<const CartState&>(state_));
  }
  /// Waits until `done(state)` returns true; returns false at the time limit.
  template <class Done>
  [[nodiscard]] bool WaitUntil(double limit_s, const Done& done) {
    return WaitForState(limit_s, [this, &done] { return See(done); });
  }

 private:
  struct Ports;
  static bool WaitForState(double limit_s, const std::function<bool()>& done);
  void Take();
  [[nodiscard]] bool IsOfTheCart(const Stamp& stamp, std::int64_t now) const;
  void Hear(NodeId node, const Stamp& stamp, std::int64_t now);
  void TakeTopology(std::int64_t now);
  void TakeFrames(std::int64_t now);
  void LookAtCheckpoints();

  std::filesystem::path session_;
  std::mutex mutex_;  ///< Guards all members below except the thread.
  CartState state_;
  std::set<std::uint64_t> ignored_;
  std::int64_t last_look_ns_ = 0;
  std::unique_ptr<Ports> ports_;
  std::jthread thread_;
};

}  // namespace fulcrum::testing
