// The simulated firmware of a cart: handles and foot pedal, each on a pseudo-terminal of its own, on one thread that
// sends what the hardware sends, when it sends it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "handle_bridge/serial/pseudo_terminal.h"
#include "handle_bridge/simulation/jaw_firmware.h"
#include "services/core/messages.h"
#include "services/runtime/cyclic_thread.h"

namespace fulcrum::handle_bridge {

/// What the operator's hands and foot do at a moment.
struct OperatorInput {
  std::array<double, kMaxTools> jaw_deg{};
  std::uint8_t pedals = kPedalNone;  ///< PedalBits.
};

class SimulatedFirmware {
 public:
  /// Index of a link: the handle of that tool, or the pedal.
  static constexpr int kPedalLink = kMaxTools;
  static constexpr int kLinks = kMaxTools + 1;
  static constexpr int kBaud = 115200;

  /// At a CLOCK_MONOTONIC time [ns]; nothing: not known yet, so nothing is sent.
  using InputAt = std::function<std::optional<OperatorInput>(std::int64_t)>;

  /// @param input called 400 times a second on the firmware's thread.
  explicit SimulatedFirmware(InputAt input, const JawFirmwareSettings& settings = {});

  /// Opens the near end of a link, now and after each Plug(). `baud` other than 115200 reads garbage, as on a wire.
  [[nodiscard]] std::unique_ptr<ByteSourceOpener> MakeOpener(int link, int baud = kBaud);

  // For tests, from any thread: what can happen to a cable.
  void Unplug(int link);
  void Plug(int link);
  void SetDamage(int link, const ByteDamage& damage);
  void SetSilent(int link, bool silent);

 private:
  struct Link {
    std::optional<PseudoTerminal> terminal;
    DamagedLine cable;
    ByteDamage damage;
    bool silent = false;
  };
  void Step(const Tick& tick);
  void Transmit(Link* link, std::string_view bytes);

  InputAt input_;
  std::array<JawFirmware, kMaxTools> jaws_;
  std::mutex mutex_;
  std::array<Link, kLinks> links_;  // Guarded by mutex_.
  std::uint64_t next_index_ = 0;
  std::uint8_t sent_pedals_ = kPedalNone;
  std::uint64_t pedal_index_ = 0;
  std::string bytes_;             // Scratch of Transmit.
  runtime::CyclicThread thread_;  // Last: stopped before the rest goes.
};

}  // namespace fulcrum::handle_bridge
