// Measures of the motion of tools: time, path length, movements, idle time, smoothness.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/base/core/assessment.h"
#include "services/base/core/messages.h"

namespace fulcrum::assessment {

/// A tip's path is low-passed on a grid of this rate before anything is measured: the devices' 9 µm steps at 1 kHz
/// would add 13 mm of path to every second.
inline constexpr double kGridRate_Hz = 100;
inline constexpr double kLowPass_Hz = 10;

/// Butterworth low-pass of second order by the bilinear transform, at the rate of the grid.
class LowPass {
 public:
  /// The filter starts at rest at the first sample.
  [[nodiscard]] Vec3d Filter(const Vec3d& x);
  void Reset() { fresh_ = true; }

 private:
  bool fresh_ = true;
  Vec3d x1_ = Vec3d::Zero(), x2_ = Vec3d::Zero(), y1_ = Vec3d::Zero(), y2_ = Vec3d::Zero();
};

/// Total of the rests that last longer than `after_s`.
class IdleClock {
 public:
  void Add(bool rests, double dt_s, double after_s);
  [[nodiscard]] double total_s() const { return total_s_; }

 private:
  double rest_s_ = 0, total_s_ = 0;
};

/// Measures of one tool.
struct ToolMotion {
  bool present = false;
  double path_m = 0;
  int movements = 0;
  IdleClock idle;
  double smoothness_sum = 0;  ///< Sum of the movements' spectral arc lengths.
  int smoothness_count = 0;
  double first_s = -1, last_s = -1;  ///< Beginning of the first movement, end of the last; negative: none.
};

/// Takes each ToolState in order and interpolates between them on a grid of kGridRate_Hz.
class MotionMeter {
 public:
  explicit MotionMeter(const AssessmentParams& params) : params_(params) {}

  void Add(double time_s, const ToolState& state);
  /// Ends the movements that are not complete at the end of the session.
  void Finish();

  [[nodiscard]] const ToolMotion& tool(int i) const { return tools_[static_cast<std::size_t>(i)]; }
  /// Time in which no tool moved.
  [[nodiscard]] double idle_s() const { return idle_.total_s(); }

 private:
  struct Track {
    LowPass filter;
    std::optional<Vec3d> last;    ///< Last filtered place on the grid.
    std::vector<double> profile;  ///< Speeds of the present movement [m/s]; empty: none.
    bool is_movement = false;     ///< The profile has exceeded the movement speed.
    int slow = 0;                 ///< Number of slow samples at the end of the profile.
  };
  /// The way of a tool from its resting place back to the hand, after a restart of haptics_node.
  struct Return {
    double until_s = -1;          ///< Session time at which it ends at the latest [s]; negative: none.
    Vec3d place = Vec3d::Zero();  ///< Of the tip in the last message before the restart [m], W.
  };
  /// Begins the return of all present tools.
  void Restart(double time_s);
  void Step(double time_s, const std::array<Vec3d, kMaxTools>& tips);
  void Follow(double time_s, double speed, Track* track, ToolMotion* tool) const;
  static void Close(Track* track, ToolMotion* tool);

  AssessmentParams params_;
  std::array<Track, kMaxTools> tracks_;
  std::array<ToolMotion, kMaxTools> tools_;
  std::array<Return, kMaxTools> returns_;
  IdleClock idle_;
  std::uint64_t epoch_ = 0;       ///< Of the newest ToolState's writer.
  std::optional<double> last_s_;  ///< Session time of the newest ToolState.
  std::array<Vec3d, kMaxTools> last_tips_{};
};

}  // namespace fulcrum::assessment
