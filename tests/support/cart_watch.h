// What a cart says on its bus: taken by a thread of its own, each millisecond, and judged as it comes.
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

/// All that is known of a cart. Times are CLOCK_MONOTONIC [ns].
struct CartState {
  /// A node's newest process, as others first had use of it: by a jaw angle, a tool, a frame, the topology, a picture.
  struct Voice {
    std::uint64_t epoch = 0;
    std::int64_t heard_ns = 0;
  };
  std::array<Voice, kNodeCount> voices;
  std::map<NodeId, Health> healths;
  std::vector<ForceJudge> judges;  ///< One a tool.

  TissueFrameHeader frame;
  /// Simulated time that a new physics did not know of any more, at most [s]. A lost step counts.
  double tissue_lost_s = 0;

  TopologyState topology;
  /// Revisions and dead edges that a later TopologyState did not know of any more.
  std::uint64_t topology_lost = 0;

  /// Newest checkpoint of a node that keeps one, and when it was not yet there.
  struct Seal {
    std::uint64_t sequence = 0;
    std::int64_t before_ns = 0;
  };
  std::map<NodeId, Seal> seals;

  std::array<std::uint64_t, kTopicCount> rejected{};  ///< At the gate, by topic.
  [[nodiscard]] double Metric(NodeId node, const std::string& name) const;
  [[nodiscard]] double peak_force_N() const;
  [[nodiscard]] double peak_step_N() const;
  /// Empty, or the first thing that a hand should not have felt.
  [[nodiscard]] std::string force_verdict() const;
};

class CartWatch {
 public:
  /// @param scene YAML, for the tools' trocars. @param session folder with the checkpoints; it may come later.
  CartWatch(int domain, const std::filesystem::path& scene, const std::filesystem::path& session);
  ~CartWatch();
  CartWatch(const CartWatch&) = delete;
  CartWatch& operator=(const CartWatch&) = delete;

  /// From now on nothing of this epoch counts: it is not of the cart.
  void Ignore(std::uint64_t epoch);
  /// What `look` returns of the state as it is now.
  template <class Look>
  auto See(const Look& look) {
    const std::lock_guard lock(mutex_);
    return look(static_cast<const CartState&>(state_));
  }
  /// Whether `done(state)` came true within the limit.
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
  std::mutex mutex_;  ///< Guards all below but the thread.
  CartState state_;
  std::set<std::uint64_t> ignored_;
  std::int64_t last_look_ns_ = 0;
  std::unique_ptr<Ports> ports_;
  std::jthread thread_;
};

}  // namespace fulcrum::testing
