// A cart during fault injection.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <random>
#include <string>

#include "tests/support/cart.h"
#include "tests/support/cart_watch.h"
#include "tests/support/rogue.h"
#include "tests/system/chaos/clock_page.h"

namespace fulcrum::testing {

inline constexpr std::array kNodes{NodeId::kPhysics, NodeId::kThermal, NodeId::kHaptics, NodeId::kHandleBridge,
                                   NodeId::kRender};

/// Damage of a checkpoint.
enum class Damage { kFlippedNewest, kFlippedAll, kCutShort, kOfTheFuture, kOfAnotherScene };

class ChaosCart {
 public:
  ChaosCart(double duration_s, int domain, std::uint32_t seed);
  ~ChaosCart();
  ChaosCart(const ChaosCart&) = delete;
  ChaosCart& operator=(const ChaosCart&) = delete;

  /// Waits until every node reports that it runs, tissue moves, the servo renders it, thermal_node receives contacts of
  /// the hook and pictures are drawn. Returns false at the limit; Trouble() then describes what is missing.
  [[nodiscard]] bool GoesOn();
  [[nodiscard]] std::string Trouble() const { return missing_ + "\n" + cart_.Said(); }

  void Kill(NodeId node);
  /// SIGSTOP, then SIGCONT.
  void Stop(NodeId node, double seconds);
  /// Runs enough busy loops to take most of every core.
  void Starve(double seconds);
  /// Sets the wall clock of all programs of the cart; has no effect under a sanitizer.
  void SetWallClock(double offset_h);
  /// A participant outside the cart floods a topic; returns the number of messages.
  std::uint64_t Pour(Flood what, double seconds);
  std::uint64_t PourBytes(int per_topic);
  /// Kills the node and damages its checkpoint before the supervisor restarts it.
  void KillAndSpoil(NodeId node, Damage damage);

  /// Waits for a random time up to `most_s`.
  void WaitAMoment(double most_s);
  [[nodiscard]] std::string Log(NodeId node) const;
  [[nodiscard]] Cart& cart() { return cart_; }
  [[nodiscard]] CartWatch& watch() { return watch_; }
  [[nodiscard]] const ClockPage& clock() const { return *clock_; }
  [[nodiscard]] const std::filesystem::path& scene() const { return scene_; }

 private:
  [[nodiscard]] pid_t Process(NodeId node) const;

  std::mt19937 random_;
  int domain_;
  std::filesystem::path folder_, scene_;
  ClockPage* clock_;
  Cart cart_;
  CartWatch watch_;
  std::string missing_;
};

}  // namespace fulcrum::testing
