// The handle_bridge node: bytes of the handles and the foot pedal in, HandleState out, at 400 Hz.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "handle_bridge/node/button_hands.h"
#include "handle_bridge/node/calibration_store.h"
#include "handle_bridge/node/jaw_channel.h"
#include "handle_bridge/node/pedal_channel.h"
#include "handle_bridge/node/watched_link.h"
#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/seqlock.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"

namespace fulcrum::handle_bridge {

/// Sender letter in the frames of a hand's handle.
[[nodiscard]] char SenderOf(config::Hand hand);

/// Settings of a handle's channel: calibration in codes (`stored`, or the cart's if null) and the range of codes that
/// it covers.
[[nodiscard]] JawChannelSettings MakeJawChannelSettings(const config::HandleConfig& handle,
                                                        const CalibrationPoints* stored);

class HandleBridgeNode {
 public:
  /// Serial links; null where the cart has none.
  struct Links {
    std::array<std::unique_ptr<WatchedLink>, kMaxTools> handles;
    std::unique_ptr<WatchedLink> pedal;
  };

  /// @param calibrations stored calibrations of all units that may be connected.
  /// @param epoch_ns CLOCK_MONOTONIC now [ns].
  /// @param tools where the buttons of the haptic devices come from; null: no button operates anything.
  HandleBridgeNode(const config::CartConfig& cart, CalibrationStore calibrations, Links links,
                   bus::Output<HandleState>* output, std::int64_t epoch_ns, bus::Input<ToolState>* tools = nullptr);

  /// One period: reads the links, estimates the jaw angles, publishes HandleState.
  void Step(const Tick& tick);
  /// After a Step: time until which the next one can wait for lines [CLOCK_MONOTONIC, ns]: later than that step where
  /// only the script moves the handles, while no jaw moves and no pedal is down. Same thread.
  [[nodiscard]] std::int64_t RestsUntil() const;
  /// May be called from any thread.
  void FillHealth(Health* health) const;

 private:
  struct LinkHealth {
    bool configured = false;
    int button = 0;  // That stands in for the line now; 0: none.
    LinkState state = LinkState::kReconnecting;
    float quality = 0;
    float jaw_deg = 0;
    std::uint32_t reconnects = 0;
    std::uint32_t calibration_points = 0;  // Points of the stored calibration in use; 0: the cart's is used.
    LinkCounts totals;
  };
  struct Snapshot {
    std::array<LinkHealth, kMaxTools + 1> links;  // The last one is the pedal's.
    std::uint8_t pedals = 0;
    bool stepping = false;  // Before the first step nothing is read, so no fault is reported.
  };

  void DropBacklog();
  void TakeCalibration(std::size_t tool);
  [[nodiscard]] HandleSample ReadHandle(std::size_t tool, double dt_s);
  [[nodiscard]] HandleSample ReadLine(std::size_t tool, double dt_s);
  [[nodiscard]] std::uint8_t ReadPedals(double dt_s);
  void Publish(const Tick& tick);

  std::array<config::HandleConfig, kMaxTools> handles_;
  CalibrationStore calibrations_;
  std::array<const CalibrationPoints*, kMaxTools> in_use_{};  // Elements of calibrations_; null: the cart's.
  Links links_;
  std::array<std::optional<JawChannel>, kMaxTools> jaws_;
  PedalChannel pedal_;
  ButtonHands buttons_;
  bus::Output<HandleState>* output_;
  bus::Stamper stamper_;
  std::uint64_t next_index_ = 0;
  HandleState state_;
  HandleState sent_;             ///< The newest published one.
  HandleState rest_;             ///< As it was at the last change, however slow: since then it rests.
  std::int64_t changed_ns_ = 0;  ///< When that was.
  std::int64_t stepped_ns_ = 0;
  const bool scripted_;  ///< All lines come from simulated units that only the script moves.
  Snapshot snapshot_;
  runtime::SeqLock<Snapshot> published_;
};

}  // namespace fulcrum::handle_bridge
