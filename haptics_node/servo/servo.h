// The 1 kHz servo without ports, clock or thread: devices and contact models in, forces to the devices and a record of
// the tick out. OfferModel() and Step() do not wait, lock, log, allocate or throw.
#pragma once

#include <array>
#include <cstdint>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/kinematics/trocar.h"
#include "haptics_node/servo/age_machine.h"
#include "haptics_node/servo/local_model.h"
#include "haptics_node/servo/model_gate.h"
#include "haptics_node/servo/output_chain.h"
#include "haptics_node/servo/passivity.h"
#include "haptics_node/servo/pose_ring.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/tick.h"

namespace fulcrum::haptics {

/// Result of one tick for the bus. `tool.stamp` has the time of the tick; its sequence is set by the writer.
struct ServoRecord {
  ToolState tool;
  std::uint64_t tick = 0;
  double session_time_s = 0;
  std::uint64_t state_hash = 0;
  std::uint64_t model_epoch = 0, model_sequence = 0;  ///< Newest contact model offered; sequence 0: none yet.
  bool model_taken = false;                           ///< A model was offered and admitted since the last tick.
};

/// Figures for Health; trivially copyable, so that another thread can get a copy through a SeqLock.
struct ServoFigures {
  ServoState state = ServoState::kOff;
  double model_age_s = -1;                  ///< Age of the model in use; negative if there is none.
  double peak_force_N = 0;                  ///< Largest hand force since the start.
  std::array<double, kMaxTools> force_N{};  ///< Hand force of each tool (idl/README.md, Forces).
  std::uint64_t models_dropped = 0;
  std::uint64_t contacts_used = 0;      ///< Models with a contact.
  std::int64_t motion_to_force_ns = 0;  ///< Of the newest of these: age of its pose when its force was first rendered.
  std::uint64_t not_finite = 0;
};

/// Settings of a servo: the part of a scene that it needs.
struct ServoSettings {
  HapticsParams params;
  std::array<ToolDescription, kMaxTools> tools{};
  /// Middle of the tissue at rest, frame W [m]: the direction from a trocar to it decides a tool's roll reference.
  Vec3f field_centre = Vec3f::Zero();
  Vec3f level_up = Vec3f::UnitZ();  ///< "Up" of a scope's level picture, frame W.
};
[[nodiscard]] ServoSettings ServoSettingsOf(const SceneView& scene);

class Servo {
 public:
  using Devices = std::array<HapticDevice*, kMaxTools>;

  /// Devices may be null; those that are not must outlive the servo. Throws InputError for a shaft that is too short.
  Servo(const ServoSettings& settings, const Devices& devices);

  /// Offers a received contact model; call before Step() of the tick that should use it.
  void OfferModel(const ContactModel& model, std::int64_t now_ns) noexcept;
  /// One tick of 1 ms nominal.
  void Step(const Tick& tick) noexcept;

  [[nodiscard]] const ServoRecord& record() const noexcept { return record_; }
  /// Forces fade or rise.
  [[nodiscard]] bool creeping() const noexcept {
    return age_.state() == ServoState::kFade || age_.state() == ServoState::kRise;
  }
  [[nodiscard]] const ServoFigures& figures() const noexcept { return figures_; }

 private:
  struct Channel {
    HapticDevice* device = nullptr;
    ToolKind kind = ToolKind::kNone;
    Trocar trocar;
    Vec3d roll_reference = Vec3d::UnitX();
    // State.
    bool started = false;
    Vec3d p_WA = Vec3d::Zero(), moved = Vec3d::Zero(), v_WA = Vec3d::Zero();
    TrocarPose pose;
    PoseRing ring;
    LocalModel model;
    PassivityController passivity;
    OutputChain output;
    Vec3d p_WT = Vec3d::Zero(), v_WT = Vec3d::Zero(), w_WT = Vec3d::Zero();  ///< Position and velocities of the proxy.
    Eigen::Quaterniond q_WT = Eigen::Quaterniond::Identity();
    double external_W = 0;
    float roll = 0;  ///< About the shaft [rad].
    std::uint8_t buttons = 0;
  };

  void ReadDevice(Channel* channel, const Tick& tick) const noexcept;
  void TakePendingModel(std::int64_t now_ns) noexcept;
  void Render(Channel* channel, const Tick& tick) const noexcept;
  void TrackProxy(Channel* channel, const Vec3d& offset, bool first) const noexcept;
  void FillRecord(const Tick& tick) noexcept;

  double force_scale_;
  std::array<Channel, kMaxTools> channels_;
  ModelGate gate_;
  AgeMachine age_;
  ContactModel pending_;
  bool has_pending_ = false;
  bool model_offered_ = false;
  std::int64_t model_time_ns_ = 0;  ///< t_s of the model in use; 0: none.
  bool model_contacts_ = false;     ///< It has contacts.
  std::int64_t last_stamp_ns_ = 0;
  double dt_ = 1e-3;  ///< Since the last tick [s].
  ServoRecord record_;
  ServoFigures figures_;
};

}  // namespace fulcrum::haptics
