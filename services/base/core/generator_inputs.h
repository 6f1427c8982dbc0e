// What pedals and panel ask of the generator at a moment. One rule for the node that owns the generator and for all
// that look at a session: assessment and maps of recordings.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum {

/// A pedal that was last heard of longer ago is up: a dead handle bridge must not burn on [ns].
inline constexpr std::int64_t kPedalTimeout_ns = 100'000'000;
/// For a moment in the past, the silence between two samples that both have the same pedal down may be this long: it
/// was the reader that was away, not the pedal [ns].
inline constexpr std::int64_t kPedalBridged_ns = 1'000'000'000;

/// Of several pedals that are down cut goes before blend, and blend before coag.
[[nodiscard]] CauteryMode ModeOf(std::uint8_t pedals);
/// 0 for kOff [W].
[[nodiscard]] float PowerOf(const GeneratorSetting& setting, CauteryMode mode);

struct GeneratorDemand {
  CauteryMode mode = CauteryMode::kOff;
  float power_W = 0;  ///< Set power of that mode; 0 also while no GeneratorSetting has come.
};

/// HandleStates and GeneratorSettings by time.
class GeneratorInputs {
 public:
  /// @param capacity of either: the oldest give way. More than a second of HandleStates.
  explicit GeneratorInputs(std::size_t capacity = 512) : capacity_(capacity) {}

  /// A sample that is not later than the newest one came from a predecessor of its writer and changes nothing.
  void Add(const HandleState& state);
  void Add(const GeneratorSetting& setting);

  /// At a moment of CLOCK_MONOTONIC [ns].
  /// @param consumed null, or gets the samples that the answer depends on, each once.
  [[nodiscard]] GeneratorDemand At(std::int64_t ns, std::vector<ConsumedInput>* consumed = nullptr) const;
  /// Drops what no moment from `ns` on needs.
  void Forget(std::int64_t ns);

  /// Stamp of the newest HandleState; negative: none has come.
  [[nodiscard]] std::int64_t newest_pedal_ns() const { return pedals_.empty() ? -1 : pedals_.back().stamp.stamp_ns; }
  [[nodiscard]] bool has_setting() const { return !settings_.empty(); }

  /// The oldest of either that is still kept, for checkpoints. Copied byte by byte.
  struct State {
    Stamp pedal_stamp, setting_stamp;  ///< stamp_ns negative: none.
    float cut_W = 0, coag_W = 0, blend_W = 0;
    std::uint8_t pedals = 0;
    std::array<std::uint8_t, 3> unused{};
  };
  [[nodiscard]] State Save() const;
  /// False, and nothing is changed, when it cannot have been saved.
  [[nodiscard]] bool Restore(const State& state);

 private:
  struct PedalSample {
    Stamp stamp;
    std::uint8_t pedals = 0;
  };
  [[nodiscard]] CauteryMode ModeAt(std::int64_t ns, std::vector<ConsumedInput>* consumed) const;

  std::size_t capacity_;
  std::deque<PedalSample> pedals_;
  std::deque<GeneratorSetting> settings_;
};

}  // namespace fulcrum
