#include "services/session/assessment/timeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fulcrum::assessment {
namespace {

/// Events of heat repeat while their cause lasts, up to ten a second: with a shorter pause they are one.
constexpr double kSame_s = 1.0;

constexpr std::array<std::pair<PedalBits, HappeningKind>, 3> kPedalKinds{{{kPedalCut, HappeningKind::kPedalCut},
                                                                          {kPedalCoag, HappeningKind::kPedalCoag},
                                                                          {kPedalBlend, HappeningKind::kPedalBlend}}};

const char* NameOf(ToolKind kind) {
  switch (kind) {
    case ToolKind::kGrasper:
      return "Grasper";
    case ToolKind::kHook:
      return "Hook";
    case ToolKind::kScissors:
      return "Scissors";
    case ToolKind::kScope:
      return "Scope";
    case ToolKind::kSuction:
      return "Suction tube";
    case ToolKind::kClipApplier:
      return "Clip applier";
    default:
      return "Instrument";
  }
}

/// What an examiner looks for, and clips, which are few.
bool IsGrave(const Happening& happening) {
  switch (happening.kind) {
    case HappeningKind::kForce:
    case HappeningKind::kSlip:
    case HappeningKind::kClip:
      return true;
    case HappeningKind::kThermal:
      return happening.thermal >= ThermalEventKind::kUreterWarning;
    default:
      return false;
  }
}

struct Names {
  const char *key, *text;
};
Names NamesOf(ThermalEventKind kind) {
  switch (kind) {
    case ThermalEventKind::kContact:
      return {"current", "Current flows"};
    case ThermalEventKind::kBlanch:
      return {"blanching", "Blanching"};
    case ThermalEventKind::kSteam:
      return {"steam", "Steam"};
    case ThermalEventKind::kCut:
      return {"cut", "Cut"};
    case ThermalEventKind::kChar:
      return {"charring", "Charring"};
    case ThermalEventKind::kUreterWarning:
      return {"ureter_warning", "Ureter warning"};
    case ThermalEventKind::kUreterInjury:
      return {"ureter_injury", "Ureter injury"};
    case ThermalEventKind::kNerveWarning:
      return {"nerve_warning", "Nerve warning"};
    case ThermalEventKind::kNerveInjury:
      return {"nerve_injury", "Nerve injury"};
    case ThermalEventKind::kQuarantine:
      return {"region_reset", "Region reset"};
    case ThermalEventKind::kSolidBurn:
      return {"organ_burnt", "Organ burnt"};
  }
  return {"unknown", "Unknown event"};
}

}  // namespace

std::string TextOf(const Happening& happening) {
  const std::string tool =
      std::string(NameOf(happening.tool_kind)) + " (tool " + std::to_string(happening.tool + 1) + ")";
  switch (happening.kind) {
    case HappeningKind::kTouch:
      return tool + " touches";
    case HappeningKind::kGrasp:
      return tool + " grasps";
    case HappeningKind::kRelease:
      return tool + " releases";
    case HappeningKind::kPedalCut:
      return "Pedal cut";
    case HappeningKind::kPedalCoag:
      return "Pedal coag";
    case HappeningKind::kPedalBlend:
      return "Pedal blend";
    case HappeningKind::kForce:
      return "Force too high";
    case HappeningKind::kSlip:
      return tool + " loses its hold";
    case HappeningKind::kClip:
      return "Clip applied (tool " + std::to_string(happening.tool + 1) + ")";
    case HappeningKind::kThermal:
      return NamesOf(happening.thermal).text;
  }
  return "Unknown event";
}

const char* KeyOf(const Happening& happening) {
  switch (happening.kind) {
    case HappeningKind::kTouch:
      return "touch";
    case HappeningKind::kGrasp:
      return "grasp";
    case HappeningKind::kRelease:
      return "release";
    case HappeningKind::kPedalCut:
      return "pedal_cut";
    case HappeningKind::kPedalCoag:
      return "pedal_coag";
    case HappeningKind::kPedalBlend:
      return "pedal_blend";
    case HappeningKind::kForce:
      return "force";
    case HappeningKind::kSlip:
      return "slip";
    case HappeningKind::kClip:
      return "clip";
    case HappeningKind::kThermal:
      return NamesOf(happening.thermal).key;
  }
  return "unknown";
}

Timeline::Timeline(std::int64_t session_start_ns, const SceneView* scene) : start_ns_(session_start_ns) {
  if (scene == nullptr) return;
  force_.emplace(scene->assessment, scene->physics);
  for (std::size_t i = 0; i < kMaxTools; ++i) assists_[i] = scene->tools[i].assists();
}

std::size_t Timeline::Begin(const Happening& happening) {
  const bool grave = IsGrave(happening);
  if ((grave ? grave_ : list_.size() - grave_) == kMost) {
    ++left_out_;
    return kNotKept;
  }
  grave_ += grave ? 1 : 0;
  list_.push_back(happening);
  return list_.size() - 1;
}

void Timeline::Add(const ToolState& state) {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (state.tools[i].kind != ToolKind::kNone) kinds_[i] = state.tools[i].kind;
  }
}

void Timeline::Add(const ContactModel& model) {
  const double time_s = TimeOf(model.stamp);
  if (time_s < 0) return;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const DeviceContacts& device = model.devices[i];
    bool touches = false, holds = false;
    for (std::size_t c = 0; c < std::min<std::size_t>(device.count, kMaxContacts); ++c) {
      const Contact& contact = device.contacts[c];
      holds |= contact.kind == ContactKind::kGrasp;
      touches |= contact.kind == ContactKind::kSurface && contact.gap <= 0;
    }
    const auto happens = [&](HappeningKind kind) {
      (void)Begin({.time_s = time_s, .until_s = time_s, .kind = kind, .tool = static_cast<int>(i)});
    };
    if ((touches || holds) && !touched_[i]) {
      touched_[i] = true;
      happens(HappeningKind::kTouch);
    }
    if (holds != holds_[i]) happens(holds ? HappeningKind::kGrasp : HappeningKind::kRelease);
    holds_[i] = holds;
  }
  if (force_) AddForces(time_s, model);
}

void Timeline::AddForces(double time_s, const ContactModel& model) {
  std::array<int, kMaxTools> slips{};
  for (std::size_t i = 0; i < kMaxTools; ++i) slips[i] = force_->tool(static_cast<int>(i)).slips;
  // As in the score, which is the trainee's.
  ContactModel own = model;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (assists_[i]) own.devices[i] = {};
  }
  if (force_->Add(time_s, own).too_high) {
    // Forces that fall below the limit for a moment are one.
    const bool same = high_force_ < kNotKept && time_s - list_[high_force_].until_s < kSame_s;
    if (!same) high_force_ = Begin({.time_s = time_s, .until_s = time_s, .kind = HappeningKind::kForce});
    if (high_force_ < kNotKept) list_[high_force_].until_s = time_s;
  }
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (force_->tool(static_cast<int>(i)).slips == slips[i]) continue;
    (void)Begin({.time_s = time_s, .until_s = time_s, .kind = HappeningKind::kSlip, .tool = static_cast<int>(i)});
  }
}

void Timeline::Add(const HandleState& state) {
  const double time_s = TimeOf(state.stamp);
  if (time_s < 0) return;
  for (std::size_t i = 0; i < kPedalKinds.size(); ++i) {
    const auto [bit, kind] = kPedalKinds[i];
    const bool down = (state.pedals & bit) != 0;
    if (down && pressed_[i] == 0) pressed_[i] = Begin({.time_s = time_s, .until_s = time_s, .kind = kind}) + 1;
    if (pressed_[i] != 0 && pressed_[i] <= list_.size()) list_[pressed_[i] - 1].until_s = time_s;
    if (!down) pressed_[i] = 0;
  }
}

void Timeline::Add(const ThermalEvent& event) {
  const double time_s = event.session_time_s;
  if (time_s < 0) return;
  const auto before = newest_thermal_.find(event.kind);
  if (before != newest_thermal_.end() && std::abs(time_s - list_[before->second].until_s) < kSame_s) {
    list_[before->second].until_s = std::max(list_[before->second].until_s, time_s);
    return;
  }
  const std::size_t at =
      Begin({.time_s = time_s, .until_s = time_s, .kind = HappeningKind::kThermal, .thermal = event.kind});
  if (at < kNotKept) newest_thermal_[event.kind] = at;
}

void Timeline::Add(const ClipState& state) {
  const double time_s = TimeOf(state.stamp);
  const std::uint32_t count = std::min<std::uint32_t>(state.count, kMaxClips);
  // The newest is the last one; a clip that falls off makes them fewer.
  for (std::uint32_t i = clips_; time_s >= 0 && i < count; ++i) {
    (void)Begin({.time_s = time_s,
                 .until_s = time_s,
                 .kind = HappeningKind::kClip,
                 .tool = static_cast<int>(state.clips[i].tool)});
  }
  clips_ = count;
}

std::vector<Happening> Timeline::happenings() const {
  std::vector<Happening> sorted = list_;
  // The kind of a tool is in another topic, whose first message may be later.
  for (Happening& one : sorted) one.tool_kind = kinds_[static_cast<std::size_t>(one.tool)];
  std::ranges::stable_sort(sorted, {}, &Happening::time_s);
  return sorted;
}

}  // namespace fulcrum::assessment
