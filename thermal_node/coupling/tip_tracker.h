// Turns CauteryContact samples into the tip's path per frame.
#pragma once

#include "services/base/core/generator_inputs.h"
#include "services/base/core/messages.h"
#include "thermal_node/coupling/source_window.h"

namespace fulcrum::thermal {

/// Between two energised samples the electrode went straight and had its current, however late the second one comes.
/// After a longer gap a new path begins.
inline constexpr double kLongestGap_s = 1.0;
inline constexpr float kTipSpeedMax_m_s = 0.3f;  ///< Farther between two samples is a jump, not a cut.
inline constexpr float kContactRadiusMin_m = 1e-4f, kContactRadiusMax_m = 2e-3f;

/// What the electrode does from one sample of its contact to the next.
struct TipInput {
  bool active = false;    ///< Touching, energised, with power.
  bool touching = false;  ///< The metal is on the tissue, energised or not.
  TipPath path;
  CauteryMode mode = CauteryMode::kOff;
  float power_W = 0;
  float duration_s = 0;  ///< 0: as long as the frame.
};
/// Samples of one frame at most; more wait for the next one.
inline constexpr std::size_t kMostSamples = 8;

class TipTracker {
 public:
  TipTracker(const Sheet& sheet, float default_radius_m) : sheet_(sheet), default_radius_m_(default_radius_m) {}

  /// The next sample. Its path runs from where the last one ended, for the session time between the two: what the
  /// tissue gets does not depend on when samples arrive.
  /// @param demand of the generator at the sample's time.
  [[nodiscard]] TipInput Advance(const CauteryContact& sample, const GeneratorDemand& demand, double dt_s);
  /// False: out of range or off the sheet; such a sample must not reach Advance.
  [[nodiscard]] bool Accepts(const CauteryContact& sample) const;
  /// The way to this sample has been gone: a physics node that was started again repeats the last tenth of a second.
  [[nodiscard]] bool Repeats(const CauteryContact& sample) const {
    return sample.session_time_s < last_s_ && sample.session_time_s > last_s_ - kLongestGap_s;
  }

  /// The last sample, for checkpoints: a process that was away goes on from where the metal was. Copied byte by byte.
  struct State {
    double last_s = -1;
    std::array<float, 2> at{};
    std::int32_t x = 0, y = 0;
    std::uint32_t width = 0, height = 0;
    std::array<std::uint8_t, std::size_t{kFootprintCells} * kFootprintCells> gap{};
    std::uint8_t on_path = 0, energised = 0;
    std::array<std::uint8_t, 6> unused{};
  };
  [[nodiscard]] State Save() const;
  /// False, and nothing is changed, when no tracker can have been in this state.
  [[nodiscard]] bool Restore(const State& state);

 private:
  const Sheet& sheet_;
  float default_radius_m_;
  double last_s_ = -1;  ///< Session time of the last sample; negative: none.
  Footprint print_;
  bool on_path_ = false;
  bool energised_ = false;  ///< The last sample had current.
  Vec2f at_ = Vec2f::Zero();
};

}  // namespace fulcrum::thermal
