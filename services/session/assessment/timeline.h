// What happened when in a session, from its messages, for the time line of a replay. It uses no bus and no clock.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"
#include "services/session/assessment/force_meter.h"

namespace fulcrum::assessment {

enum class HappeningKind : std::uint8_t {
  kTouch,     ///< A tool touches tissue for the first time.
  kGrasp,     ///< A tool begins to hold tissue.
  kRelease,   ///< The tissue that a tool held is free again.
  kPedalCut,  ///< A pedal is down.
  kPedalCoag,
  kPedalBlend,
  kForce,    ///< The tissue's force on a tool is above the highest that the scene's exercise allows.
  kSlip,     ///< Tissue slips out of closed jaws.
  kClip,     ///< A clip applier leaves a clip.
  kThermal,  ///< A ThermalEvent; `thermal` names it.
};

struct Happening {
  double time_s = 0;   ///< Session time of the begin [s].
  double until_s = 0;  ///< Session time of the end [s]; `time_s` for what has no duration.
  HappeningKind kind = HappeningKind::kTouch;
  int tool = 0;                                           ///< Of kTouch, kGrasp, kRelease, kSlip and kClip.
  ToolKind tool_kind = ToolKind::kNone;                   ///< Of the same.
  ThermalEventKind thermal = ThermalEventKind::kContact;  ///< Of kThermal.
};

/// Short text for people, such as "Grasper (tool 1) grasps" or "Ureter warning".
[[nodiscard]] std::string TextOf(const Happening& happening);
/// Name of the kind in files and on the page: "touch", "grasp", "release", "pedal_cut", "pedal_coag", "pedal_blend",
/// "force", "slip", "clip", "current", "blanching", "steam", "cut", "charring", "ureter_warning", "ureter_injury",
/// "nerve_warning", "nerve_injury", "region_reset", "organ_burnt".
[[nodiscard]] const char* KeyOf(const Happening& happening);

/// Takes each message in the order of its writer. The order between topics does not matter.
class Timeline {
 public:
  /// More are counted, but not kept: so many of the grave ones (injuries, warnings, burnt organs, regions reset,
  /// forces, slips) and of clips together, and so many of all others, which are frequent.
  static constexpr std::size_t kMost = 500;

  /// @param session_start_ns CLOCK_MONOTONIC at session time 0 [ns]; earlier messages do not count.
  /// @param scene of the session; null: neither forces nor slips are judged. Those of an assistant never are.
  explicit Timeline(std::int64_t session_start_ns, const SceneView* scene = nullptr);

  void Add(const ToolState& state);
  void Add(const ContactModel& model);
  void Add(const HandleState& state);
  void Add(const ThermalEvent& event);
  void Add(const ClipState& state);

  /// In the order of their begins. A pedal that is still down lasts until its newest message.
  [[nodiscard]] std::vector<Happening> happenings() const;
  /// Number of those that were not kept.
  [[nodiscard]] std::size_t left_out() const { return left_out_; }

 private:
  static constexpr int kPedals = 3;
  [[nodiscard]] double TimeOf(const Stamp& stamp) const {
    return 1e-9 * static_cast<double>(stamp.stamp_ns - start_ns_);
  }
  /// Above all indices of `list_`.
  static constexpr std::size_t kNotKept = 2 * kMost;
  /// Index of the new one; kNotKept when it is not kept.
  std::size_t Begin(const Happening& happening);
  void AddForces(double time_s, const ContactModel& model);

  std::int64_t start_ns_;
  std::optional<ForceMeter> force_;
  std::array<bool, kMaxTools> assists_{};  ///< The scene holds this tool for the trainee.
  std::size_t high_force_ = kNotKept;      ///< Index in `list_` of the newest.
  std::vector<Happening> list_;
  std::size_t grave_ = 0;  ///< Number of grave ones and clips in `list_`.
  std::size_t left_out_ = 0;
  std::array<ToolKind, kMaxTools> kinds_{};
  std::array<bool, kMaxTools> touched_{}, holds_{};
  std::uint32_t clips_ = 0;                                 ///< In the newest ClipState.
  std::array<std::size_t, kPedals> pressed_{};              ///< Index in `list_`, plus 1; 0: the pedal is up.
  std::map<ThermalEventKind, std::size_t> newest_thermal_;  ///< Index in `list_`.
};

}  // namespace fulcrum::assessment
