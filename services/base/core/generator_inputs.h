// Mode and power that pedals and panel demand of the generator at a given time. One rule for the node that owns the
// generator, for the assessment and for the maps of recordings.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum {

/// A pedal without a message for longer than this counts as up: if the handle bridge has failed, the current must stop
/// [ns].
inline constexpr std::int64_t kPedalTimeout_ns = 100'000'000;
/// For times in the past: longest gap between two samples with the same pedal down that counts as pedal down. Such a
/// gap means that the reader has missed samples [ns].
inline constexpr std::int64_t kPedalBridged_ns = 1'000'000'000;

/// Mode of the pedals that are down: cut before blend, and blend before coag.
[[nodiscard]] CauteryMode ModeOf(std::uint8_t pedals);
/// Set power of a mode [W]; 0 for kOff.
[[nodiscard]] float PowerOf(const GeneratorSetting& setting, CauteryMode mode);

struct GeneratorDemand {
  CauteryMode mode = CauteryMode::kOff;
  float power_W = 0;  ///< Set power of that mode; 0 also before the first GeneratorSetting.
};

/// HandleStates and GeneratorSettings by time.
class GeneratorInputs {
 public:
  /// @param capacity number of samples kept of either kind; the oldest are dropped. The default is more than a second
  /// of HandleStates.
  explicit GeneratorInputs(std::size_t capacity = 512) : capacity_(capacity) {}

  /// Adds a sample. One that is not later than the newest came from a predecessor of its writer and is ignored.
  void Add(const HandleState& state);
  void Add(const GeneratorSetting& setting);

  /// Demand at a time of CLOCK_MONOTONIC [ns].
  /// @param consumed nullptr, or receives the samples that the result depends on, each once.
  [[nodiscard]] GeneratorDemand At(std::int64_t ns, std::vector<ConsumedInput>* consumed = nullptr) const;
  /// Drops the samples that no query for `ns` or later needs.
  void DropBefore(std::int64_t ns);

  /// Stamp of the newest HandleState; negative: none has come.
  [[nodiscard]] std::int64_t newest_pedal_ns() const { return pedals_.empty() ? -1 : pedals_.back().stamp.stamp_ns; }
  [[nodiscard]] bool has_setting() const { return !settings_.empty(); }

  /// The oldest sample of either kind that is still kept, for checkpoints. Copied byte by byte.
  struct State {
    Stamp pedal_stamp, setting_stamp;  ///< stamp_ns negative: none.
    float cut_W = 0, coag_W = 0, blend_W = 0;
    std::uint8_t pedals = 0;
    std::array<std::uint8_t, 3> unused{};
  };
  [[nodiscard]] State Save() const;
  /// Restores a saved state. Returns false and changes nothing if the state is not valid.
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
