// The simulated firmware of a cart: handles and foot pedal, each on a pseudo-terminal of its own. One thread sends the
// same lines as the hardware, at the same times, and reproduces its faults.
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
#include "services/base/core/messages.h"
#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::handle_bridge {

/// Index of a link: the handle of that tool, or the pedal.
inline constexpr std::size_t kPedalLink = kMaxTools;
inline constexpr std::size_t kLinks = kMaxTools + 1;

/// Properties of a simulated unit.
struct SimulatedUnit {
  std::string serial_number;
  bool framed = false;      ///< Sends frames (frame.h) instead of plain lines.
  char sender = 'L';        ///< Sender letter of its frames.
  JawFirmwareSettings jaw;  ///< Potentiometer and converter of a handle.
};

/// Faults of a link at a given time.
struct LinkFaults {
  ByteDamage cable{};
  bool silent = false;       ///< No power, or the transmit wire is broken.
  bool wrong_baud = false;   ///< The unit sends at SimulatedFirmware::kOtherBaud.
  bool broken_wire = false;  ///< A wire of the potentiometer is broken: the converter's input floats.
  bool unplugged = false;    ///< The adapter is unplugged: a hang-up, and a new port afterwards.
};

/// Input of the operator's hands and foot at a given time, and faults of the links.
struct SimulatedInput {
  std::array<double, kMaxTools> jaw_deg{};
  std::uint8_t pedals = kPedalNone;  ///< PedalBits.
  std::array<LinkFaults, kLinks> faults{};
};

class SimulatedFirmware {
 public:
  static constexpr int kBaud = 115200;
  static constexpr int kOtherBaud = 57600;

  /// Input at a CLOCK_MONOTONIC time [ns]; no value: not known yet, so nothing is sent.
  using InputAt = std::function<std::optional<SimulatedInput>(std::int64_t)>;

  /// While the input does not change, lines are sent in bursts, as an adapter with a buffer delivers them.
  struct Rest {
    /// Time until which the input stays as it is at this one [CLOCK_MONOTONIC, ns]; null: unknown.
    std::function<std::int64_t(std::int64_t)> until;
    runtime::Bell* sent = nullptr;  ///< Rung when lines have been sent; null: none. Outlives the firmware.
  };

  /// @param input called for each 1/400 s on the firmware's thread.
  explicit SimulatedFirmware(InputAt input, const std::array<SimulatedUnit, kLinks>& units = DefaultUnits())
      : SimulatedFirmware(std::move(input), units, Rest()) {}
  SimulatedFirmware(InputAt input, const std::array<SimulatedUnit, kLinks>& units, Rest rest);

  /// Plain lines, the paper's potentiometers.
  static std::array<SimulatedUnit, kLinks> DefaultUnits();

  /// Opener of the bridge's end of a link, which is simulated from then on; may be used again after each hang-up.
  /// Reading at another speed than the unit's gives garbage, as on a wire.
  [[nodiscard]] std::unique_ptr<ByteSourceOpener> MakeOpener(std::size_t link);

 private:
  struct Link {
    explicit Link(std::uint64_t seed) : cable(seed) {}
    bool used = false;  ///< MakeOpener() was called for it.
    std::optional<PseudoTerminal> terminal;
    DamagedLine cable;
    std::uint8_t sequence = 0;
  };
  void Step(const Tick& tick);
  [[nodiscard]] std::int64_t RestsUntil() const;
  void Plug(Link* link, bool plugged);
  void SendJaw(std::size_t tool, double jaw_deg, const LinkFaults& faults);
  void SendPedals(std::uint8_t pedals, const LinkFaults& faults);
  void Transmit(Link* link, std::string_view bytes, const LinkFaults& faults);

  InputAt input_;
  Rest rest_;
  std::array<SimulatedUnit, kLinks> units_;
  std::array<JawFirmware, kMaxTools> jaws_;
  std::mutex mutex_;
  std::array<Link, kLinks> links_;  // Guarded by mutex_.
  std::uint64_t next_index_ = 0;
  std::int64_t stepped_ns_ = 0;
  std::uint8_t sent_pedals_ = kPedalNone;
  std::uint64_t pedal_index_ = 0;
  std::uint64_t floating_ = 1;    // State of the random generator for a broken wire.
  std::string bytes_;             // Scratch of Transmit.
  runtime::Bell bell_;            // Nothing rings it: the end of a rest is known at its begin.
  runtime::CyclicThread thread_;  // Last member: stopped before the others are destroyed.
};

}  // namespace fulcrum::handle_bridge
