// Converts CauteryContact samples into paths of the tip.
#pragma once

#include "services/base/core/generator_inputs.h"
#include "services/base/core/messages.h"
#include "thermal_node/coupling/source_window.h"

namespace fulcrum::thermal {

/// Two energised samples up to this far apart are joined by a straight path with current, however late the second one
/// arrives; so lost samples leave no bridge in the slit. After a longer gap a new path begins [s].
inline constexpr double kLongestGap_s = 1.0;
/// Faster motion between two samples is a jump and cuts nothing [m/s].
inline constexpr float kTipSpeedMax_m_s = 0.3f;
inline constexpr float kContactRadiusMin_m = 1e-4f, kContactRadiusMax_m = 2e-3f;

/// Motion and state of the electrode from one sample of its contact to the next.
struct TipInput {
  bool active = false;    ///< Touching, energised, with power.
  bool touching = false;  ///< The metal is on the tissue, energised or not.
  TipPath path;
  CauteryMode mode = CauteryMode::kOff;
  float power_W = 0;
  float duration_s = 0;  ///< [s]; 0: the frame's time step.
};
/// Maximum number of samples in one frame; further samples stay queued for the next one.
inline constexpr std::size_t kMostSamples = 8;

class TipTracker {
 public:
  /// @param surface the one whose contacts count; a sample on the other is one without contact.
  TipTracker(const Sheet& sheet, float default_radius_m, BurntSurface surface = BurntSurface::kMembrane)
      : sheet_(sheet), default_radius_m_(default_radius_m), surface_(surface) {}

  /// Converts the next sample. Its path starts at the end of the last one and lasts for the session time between the
  /// two, so the heat does not depend on when samples arrive.
  /// @param demand mode and set power at the sample's time.
  [[nodiscard]] TipInput Advance(const CauteryContact& sample, const GeneratorDemand& demand, double dt_s);
  /// The next sample begins a new path: its place says nothing of the last one's.
  void BreakPath() { on_path_ = false; }
  /// Returns false for a sample that is out of range or off the sheet; it must not be passed to Advance.
  [[nodiscard]] bool Accepts(const CauteryContact& sample) const;
  /// Returns true if the path to this sample has been applied already: a restarted physics node repeats the last tenth
  /// of a second, and a restarted thermal node receives samples from before its checkpoint, the newest one included.
  [[nodiscard]] bool Repeats(const CauteryContact& sample) const {
    return last_s_ >= 0 && sample.session_time_s <= last_s_ && sample.session_time_s > last_s_ - kLongestGap_s;
  }

  /// Last sample, for checkpoints: a restarted process continues the path from there. Copied byte by byte.
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
  /// Returns false, and changes nothing, if no tracker can have been in this state.
  [[nodiscard]] bool Restore(const State& state);

 private:
  [[nodiscard]] bool Touches(const CauteryContact& sample) const {
    return surface_ == BurntSurface::kSolids ? sample.on_solid : sample.touching;
  }

  const Sheet& sheet_;
  float default_radius_m_;
  BurntSurface surface_;
  double last_s_ = -1;  ///< Session time of the last sample; negative: none.
  Footprint print_;
  bool on_path_ = false;
  bool energised_ = false;  ///< The last sample had current.
  Vec2f at_ = Vec2f::Zero();
};

}  // namespace fulcrum::thermal
