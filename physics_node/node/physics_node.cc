#include "physics_node/node/physics_node.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "physics_node/node/contact_pace.h"
#include "physics_node/node/physics_checkpoint.h"
#include "services/base/core/contact_force.h"

namespace fulcrum::physics {
namespace {

/// Interval of checkpoints and of measurements of the displacement [ticks].
constexpr std::uint64_t kSlowTicks = 10;
/// Time from the last frame in motion to the next one [s]. It doubles with each frame at rest, so that a reader that
/// lost one of the first soon gets another, up to the longest; while surfaces breathe it does not.
constexpr double kFirstSilence_s = 0.1, kLongestSilence_s = 2;
/// Number of ToolStates without a tool after which the tool is removed.
constexpr int kAbsentTicks = 100;
/// Time without skipped periods after which the next dearer preset is set again [ticks].
constexpr int kRecoveryTicks = 200;
/// Longest wait of a restarted process for tools and handles [ns].
constexpr std::int64_t kWaitNs = 100'000'000;
/// After a restart the tools move from their last poses for the tissue to their present ones in this time [s], with the
/// contact dated accordingly: the motion of the outage is repeated at a higher speed, and no tool passes through tissue
/// that it was pushing. Not after a longer outage [s], nor over a longer distance [m].
constexpr float kCatchUp_s = 0.4f, kLongestOutage_s = 0.8f, kCatchUpMost_m = 0.01f;
/// Rounding error of session time / dt in double [ticks]: 0.29 / 0.01 < 29.
constexpr double kRoundingTicks = 1e-6;
/// Duration of Health's warning of a limited force [ticks]; Health is published ten times a second.
constexpr std::uint64_t kWarnTicks = 100;
/// Largest jaw angle of an input [rad]: beyond the opening of any instrument.
constexpr float kMaxJaw_rad = 1.6f;
/// Share of the limit from which on a force counts as limited, where the low-pass filter only approaches it.
constexpr float kFilteredCapShare = 0.99f;

}  // namespace

PhysicsNode::PhysicsNode(const SceneView& scene, const Ports& ports, runtime::CheckpointFile* checkpoint,
                         std::int64_t epoch_ns, int threads, bool follows)
    : scene_(scene),
      ports_(ports),
      checkpoint_(checkpoint),
      simulation_(scene, threads),
      hook_(static_cast<std::uint32_t>(FindTool(scene.tools, ToolKind::kHook).value_or(kMaxTools))),
      stampers_(epoch_ns) {
  clip_revisions_.saved = simulation_.clips().revision();
  for (ToolInput& input : inputs_) {
    // Until the first HandleState, between the angles for closing and opening: jaws neither grasp nor release.
    input.pose.jaw_rad = 0.5f * (scene.physics.grasp_close_rad + scene.physics.grasp_open_rad);
  }
  if (checkpoint_ == nullptr || follows) {
    return;
  }
  if (const auto latest = checkpoint_->Latest()) {
    restart_.restored = Restore(latest->payload);
  }
}

bool PhysicsNode::Restore(std::span<const std::byte> checkpoint) {
  const auto state = ReadCheckpoint(checkpoint, &simulation_);
  if (!state) {
    return false;
  }
  max_displacement_m_ = state->max_displacement_m;
  time_.contact_s = state->contact_time_s;
  restart_.catch_up_steps = std::max(1, static_cast<int>(std::lround(kCatchUp_s / scene_.physics.dt_s)));
  tear_counts_.saved = simulation_.tears().torn_count();
  clip_revisions_.saved = simulation_.clips().revision();
  const SimulationMemory memory = simulation_.Save();
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (memory.known[i]) {
      inputs_[i] = {true, memory.pose[i]};
    }
  }
  return true;
}

void PhysicsNode::TakeKept(const Kept& kept) {
  topology_state_ = kept.topology;
  open_cells_ = kept.open_cells;
  topology_waits_ = kept.topology.stamp.sequence != 0;
  open_cells_wait_ = kept.open_cells.stamp.sequence != 0;
}

void PhysicsNode::Follow(const Tick& tick) {
  ticks_.last_index = tick.index;
  // Inputs are not applied before this process leads; from then on it behaves as a new process.
  tool_states_.Take(&ports_.tools);
  handle_states_.Take(&ports_.handles);
  topology_waits_ |= ports_.topology.TakeLatest(&topology_state_);
}

bool PhysicsNode::TakeOver(std::span<const std::byte> other, const Tick& tick) {
  stampers_ = Stampers(tick.stamp_ns);
  ticks_.first_index = tick.index;
  const auto own = checkpoint_ == nullptr ? std::nullopt : checkpoint_->Latest();
  const bool own_is_newer = own && CheckpointPeriods(own->payload) > CheckpointPeriods(other);
  restart_.restored = Restore(own_is_newer ? own->payload : other);
  return restart_.restored;
}

/// Poses at `now_ns`, between the two samples around it.
void PhysicsNode::TakeTools(std::int64_t now_ns) {
  if (tool_states_.empty()) {
    time_.contact_s = time_.step_s;
    return;
  }
  tool_states_.DropBefore(now_ns);
  const ToolState& before = tool_states_.before();
  const ToolState& after = tool_states_.after() != nullptr ? *tool_states_.after() : before;
  contact_rest_.Follow(before, after);
  const std::int64_t begin = before.stamp.stamp_ns, end = after.stamp.stamp_ns;
  const float u =
      end > begin ? std::clamp(static_cast<float>(now_ns - begin) / static_cast<float>(end - begin), 0.0f, 1.0f) : 0.0f;
  const bool is_new =
      before.stamp.sequence != used_.tool_before.sequence || before.stamp.epoch != used_.tool_before.epoch;
  used_.tool_before = before.stamp;
  used_.tool_after = after.stamp;
  used_.pose_ns = begin + static_cast<std::int64_t>(u * static_cast<float>(end - begin));
  const std::array<ToolInput, kMaxTools> last = inputs_;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const ToolSample &a = before.tools[i], &b = after.tools[i];
    if (a.kind != ToolKind::kNone && TouchesTissue(scene_.tools[i].kind)) {
      const bool both = b.kind == a.kind;
      const ToolPose from{a.p_WT, a.q_WT.normalized(), inputs_[i].pose.jaw_rad};
      const ToolPose to = both ? ToolPose{b.p_WT, b.q_WT.normalized(), from.jaw_rad} : from;
      inputs_[i].present = true;
      inputs_[i].pose = Interpolate(from, to, u);
      absent_ticks_[i] = 0;
    } else if (inputs_[i].present && is_new && ++absent_ticks_[i] > kAbsentTicks) {
      inputs_[i].present = false;
    }
  }
  CatchUp(last);
}

void PhysicsNode::CatchUp(const std::array<ToolInput, kMaxTools>& last) {
  const double behind_s = time_.step_s - time_.contact_s;
  if (restart_.catch_up_steps == 0 || !(behind_s > 0 && behind_s < kLongestOutage_s)) {
    restart_.catch_up_steps = 0;
    time_.contact_s = time_.step_s;
    return;
  }
  // Equal parts of the present delay and of the time that passes until the last of these steps.
  const double dt = static_cast<double>(scene_.physics.dt_s), steps = restart_.catch_up_steps--;
  const double advance_s = std::min(behind_s, (behind_s + (steps - 1) * dt) / steps);
  const auto share = static_cast<float>(advance_s / behind_s);
  time_.contact_s += advance_s;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const ToolPose &from = last[i].pose, &to = inputs_[i].pose;
    if (inputs_[i].present && last[i].present && (to.p_WT - from.p_WT).norm() < kCatchUpMost_m) {
      inputs_[i].pose = Interpolate(from, to, share);
    }
  }
}

void PhysicsNode::TakeHandles(std::int64_t now_ns) {
  if (handle_states_.empty()) {
    return;
  }
  handle_states_.DropBefore(now_ns);
  const HandleState& state = handle_states_.before();
  used_.handle = state.stamp;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const HandleSample& handle = state.handles[i];
    if (handle.present && handle.quality > 0.0f) {
      inputs_[i].pose.jaw_rad = std::clamp(handle.jaw_angle_rad, 0.0f, kMaxJaw_rad);
    }
  }
}

void PhysicsNode::TakeInputs(const Tick& tick) {
  // The step stands for session time k dt, independent of the time within the period at which the thread woke: equal
  // hands give equal poses on a busy machine. k advances by whole periods, also if the thread wakes in the next one.
  double step_s = tick.session_time_s;
  if (tick.dt_s > 0) {
    const double latest = std::floor(tick.session_time_s / tick.dt_s + kRoundingTicks);
    time_.k =
        ticks_.count == 0 ? latest : std::clamp(time_.k + static_cast<double>(ticks_.periods), latest - 1, latest);
    step_s = time_.k * tick.dt_s;
  }
  const auto now_ns = tick.stamp_ns - static_cast<std::int64_t>(1e9 * (tick.session_time_s - step_s));
  time_.step_s = std::max(step_s, 0.0);
  tool_states_.Take(&ports_.tools);
  handle_states_.Take(&ports_.handles);
  ticks_.start_ns = ticks_.count == 0 ? tick.stamp_ns : ticks_.start_ns;
  restart_.waits = restart_.restored && (tool_states_.empty() || handle_states_.empty()) &&
                   tick.stamp_ns - ticks_.start_ns < kWaitNs;
  if (!restart_.waits) {
    TakeTools(now_ns);
    TakeHandles(now_ns);
  }
  if (ports_.topology.TakeLatest(&topology_state_) || topology_waits_) {
    const int edits = topology_state_.scene_hash == scene_.hash ? simulation_.ApplyTopology(topology_state_) : -1;
    if (edits < 0) {
      figures_.topology_refused.fetch_add(1, std::memory_order_relaxed);
    } else {
      figures_.topology_edits.fetch_add(static_cast<std::uint64_t>(edits), std::memory_order_relaxed);
    }
  }
  topology_waits_ = false;
  if ((ports_.open_cells.TakeLatest(&open_cells_) || open_cells_wait_) && !simulation_.SetOpenCells(open_cells_)) {
    figures_.topology_refused.fetch_add(1, std::memory_order_relaxed);
  }
  open_cells_wait_ = false;
}

/// A skipped period means that the last step ran late: a cheaper preset is set for some time. The first step, which
/// initialises the caches, does not count. A replay skips the recorded periods, so it does not depend on its machine.
void PhysicsNode::AdaptPreset(const Tick& tick) {
  const bool late = ticks_.count > 1 && tick.index > ticks_.last_index + 1;
  ticks_.periods = tick.index > ticks_.last_index ? tick.index - ticks_.last_index : 1;
  ticks_.last_index = tick.index;
  ticks_.in_time = late ? 0 : ticks_.in_time + 1;
  const std::uint32_t cheaper = figures_.cheaper.load(std::memory_order_relaxed);
  if (late) {
    figures_.cheaper.store(simulation_.SetCheaper(cheaper + 1), std::memory_order_relaxed);
  } else if (cheaper > 0 && ticks_.in_time % kRecoveryTicks == 0) {
    figures_.cheaper.store(simulation_.SetCheaper(cheaper - 1), std::memory_order_relaxed);
  }
}

void PhysicsNode::Step(const Tick& tick) {
  AdaptPreset(tick);
  TakeInputs(tick);
  const StepReport report = simulation_.Step(inputs_, ticks_.count == 0 ? 1 : ticks_.periods);
  figures_.asleep_ticks.fetch_add(report.asleep ? 1 : 0, std::memory_order_relaxed);
  MeasurePace();
  PublishContacts(tick, report.asleep);
  PublishCautery(tick);
  PublishFrame(tick);
  Measure();
  // The manifest before the checkpoint: a replay finds every tick that a checkpoint contains, and the first state of
  // the next process shows whether the last one wrote its checkpoint.
  PublishManifest(tick);
  SaveCheckpoint();
  PublishTears(tick);
  PublishClips(tick);
  ++ticks_.count;
}

/// The first step, after which periods are skipped while caches are initialised, does not count.
void PhysicsNode::MeasurePace() {
  if (ticks_.count <= 1) return;
  const double dt_s = static_cast<double>(scene_.physics.dt_s);
  const std::uint64_t simulated = simulation_.step_periods();
  pace_.Add(dt_s * static_cast<double>(simulated), dt_s * static_cast<double>(ticks_.periods));
  figures_.pace.store(static_cast<float>(pace_.value()), std::memory_order_relaxed);
  if (ticks_.periods > simulated) {
    figures_.lost_periods.fetch_add(ticks_.periods - simulated, std::memory_order_relaxed);
  }
}

void PhysicsNode::PublishContacts(const Tick& tick, bool asleep) {
  // Without readers only where the solver provides the forces: otherwise slip needs those of the contact probe.
  if (scene_.physics.mode == PhysicsMode::kAccurate && !ports_.contacts.has_readers()) {
    for (std::uint32_t i = 0; i < kMaxTools; ++i) {
      NoteForce(i, static_cast<double>(simulation_.solver_force(i).norm()));
    }
    contact_rest_.Decide(asleep, tick.index);
    return;
  }
  ContactModel model;
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    model.devices[i] = simulation_.Contacts(i);
    NoteForce(i, TissueForce(model.devices[i]).norm());
    ToRealTime(pace_.value(), &model.devices[i]);
    asleep = asleep && model.devices[i].count == 0;
  }
  contact_rest_.Decide(asleep, tick.index);
  // The servo dates the model by the tool sample, so there is no model without one.
  if (used_.tool_before.sequence == 0 || !ports_.contacts.has_readers() || !contact_rest_.due()) return;
  model.stamp = stampers_.contact.Next(tick.stamp_ns);
  model.tool_sequence = used_.tool_before.sequence;
  model.tool_stamp_ns = used_.pose_ns;
  model.physics_dt_s = scene_.physics.dt_s;
  ports_.contacts.Write(model);
}

void PhysicsNode::NoteForce(std::size_t tool, double force_N) {
  figures_.force_N[tool].store(force_N, std::memory_order_relaxed);
  // This thread alone writes it.
  if (force_N > figures_.peak_force_N.load(std::memory_order_relaxed)) {
    figures_.peak_force_N.store(force_N, std::memory_order_relaxed);
  }
}

void PhysicsNode::PublishCautery(const Tick& tick) {
  // While waiting after a restart the pose is unknown; a sample without contact would leave a bridge in the slit.
  if (hook_ == kMaxTools || restart_.waits || !ports_.cautery.has_readers()) {
    return;
  }
  CauteryContact contact = simulation_.Cautery(hook_);
  if (!contact_rest_.due() && !contact.touching && !contact.on_solid) return;
  contact.stamp = stampers_.cautery.Next(tick.stamp_ns);
  contact.session_time_s = time_.contact_s;
  contact.topology_revision = simulation_.model().revision();
  ports_.cautery.Write(contact);
}

void PhysicsNode::PublishFrame(const Tick& tick) {
  const bool moved = versions_.frame != simulation_.state_version();
  if (!ports_.frames.has_readers() || (!moved && tick.index < frame_.due_index)) {
    return;
  }
  versions_.frame = simulation_.state_version();
  const double dt_s = static_cast<double>(scene_.physics.dt_s);
  frame_.silence_s =
      moved || scene_.breathing.amplitude_m > 0 ? kFirstSilence_s : std::min(2 * frame_.silence_s, kLongestSilence_s);
  frame_.due_index = tick.index + static_cast<std::uint64_t>(std::max(std::floor(frame_.silence_s / dt_s), 1.0));
  ports_.frames.WriteInPlace([&](TissueFrame::View view) {
    FillFrame(tick, view);
    view.header.stamp = stampers_.frame.Next(tick.stamp_ns);
    view.header.next_within_s = std::max(frame_.silence_s, dt_s);
  });
}

void PhysicsNode::FillFrame(const Tick& tick, TissueFrame::View view) const {
  TissueFrameHeader& header = view.header;
  header.scene_hash = scene_.hash;
  header.topology_revision = simulation_.model().revision();
  header.tool_sequence = used_.tool_before.sequence;
  header.handle_sequence = used_.handle.sequence;
  header.session_time_s = tick.session_time_s;
  header.simulated_time_s = simulation_.simulated_time_s();
  header.next_within_s = kFirstSilence_s;
  header.vertex_count = simulation_.particles().particle_count();
  header.grasping_tools = 0;
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    header.grasping_tools |= simulation_.grasp(i).holding() ? 1u << i : 0u;
  }
  view.xyz.resize(3 * std::size_t{header.vertex_count});
  simulation_.particles().CopyPositions(view.xyz);
}

void PhysicsNode::PublishManifest(const Tick& tick) {
  if (!ports_.manifests.has_readers()) {
    return;
  }
  if (versions_.hash != simulation_.state_version()) {
    versions_.hash = simulation_.state_version();
    state_hash_ = simulation_.StateHash();
  }
  manifest_.stamp = stampers_.manifest.Next(tick.stamp_ns);
  manifest_.node = NodeId::kPhysics;
  manifest_.tick = tick.index - ticks_.first_index;
  manifest_.session_time_s = tick.session_time_s;
  manifest_.state_hash = state_hash_;
  const auto consumed = [](TopicId topic, const Stamp& stamp) {
    return ConsumedInput{topic, stamp.epoch, stamp.sequence};
  };
  manifest_.consumed = {consumed(TopicId::kToolState, used_.tool_before),
                        consumed(TopicId::kToolState, used_.tool_after), consumed(TopicId::kHandleState, used_.handle),
                        consumed(TopicId::kTopologyState, topology_state_.stamp),
                        consumed(TopicId::kOpenCells, open_cells_.stamp)};
  ports_.manifests.Write(manifest_);
}

void PhysicsNode::Measure() {
  figures_.quarantined.store(simulation_.quarantined(), std::memory_order_relaxed);
  figures_.grasped.store(simulation_.held_particles(), std::memory_order_relaxed);
  figures_.torn_edges.store(simulation_.tears().torn_count(), std::memory_order_relaxed);
  const Clips& clips = simulation_.clips();
  figures_.clips.store(static_cast<std::uint32_t>(clips.count()), std::memory_order_relaxed);
  figures_.clips_lost.store(clips.lost(), std::memory_order_relaxed);
  figures_.clips_refused.store(clips.refused(), std::memory_order_relaxed);
  figures_.nearest_to_tearing.store(simulation_.tears().nearest(), std::memory_order_relaxed);
  figures_.largest_stretch.store(simulation_.tears().largest_stretch_ever(), std::memory_order_relaxed);
  std::uint32_t limited = 0;
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    const bool from_solver = scene_.physics.mode == PhysicsMode::kAccurate;
    const float force = (from_solver ? simulation_.solver_force(i) : simulation_.force(i)).norm();
    // Forces of the contact probe are limited before its low-pass filter.
    if (force >= (from_solver ? ContactProbe::kForceCap_N : kFilteredCapShare * ContactProbe::kForceCap_N)) {
      limited_until_[i] = ticks_.count + kWarnTicks;
    }
    limited |= limited_until_[i] > ticks_.count ? 1u << i : 0u;
  }
  figures_.limited.store(limited, std::memory_order_relaxed);
  if (ticks_.count % kSlowTicks != kSlowTicks / 2 || versions_.measured == simulation_.state_version()) {
    return;
  }
  versions_.measured = simulation_.state_version();
  const float displacement = simulation_.MaxDisplacement();
  max_displacement_m_ = std::max(max_displacement_m_, displacement);
  figures_.displacement_mm.store(1e3f * displacement, std::memory_order_relaxed);
  figures_.max_displacement_mm.store(1e3f * max_displacement_m_, std::memory_order_relaxed);
}

void PhysicsNode::SaveCheckpoint() {
  const std::uint32_t torn = simulation_.tears().torn_count();
  const std::uint64_t clips = simulation_.clips().revision();
  const bool due = torn != tear_counts_.saved || clips != clip_revisions_.saved ||
                   (ticks_.count % kSlowTicks == 0 && versions_.saved != simulation_.state_version());
  if (checkpoint_ == nullptr || !due) {
    return;
  }
  tear_counts_.saved = torn;
  clip_revisions_.saved = clips;
  versions_.saved = simulation_.state_version();
  checkpoint_->Commit(WriteCheckpoint(simulation_, {max_displacement_m_, time_.contact_s}, checkpoint_->Begin()));
}

/// After the checkpoint, so that a published tear survives this process.
void PhysicsNode::PublishTears(const Tick& tick) {
  const TearWatch& tears = simulation_.tears();
  if (tears.torn_count() == tear_counts_.published) {
    return;
  }
  tear_state_.stamp = stampers_.tear.Next(tick.stamp_ns);
  tear_state_.scene_hash = scene_.hash;
  tear_state_.rows = scene_.membrane.rows;
  tear_state_.cols = scene_.membrane.cols;
  tear_state_.torn_edges.assign(tears.torn().begin(), tears.torn().end());
  // Repeated in the next tick if it was not sent.
  if (ports_.tears.Write(tear_state_)) {
    tear_counts_.published = tears.torn_count();
  }
}

/// After the checkpoint, as tears. The first tick publishes as well: readers drop what another process has left.
void PhysicsNode::PublishClips(const Tick& tick) {
  const Clips& clips = simulation_.clips();
  if (!clips.possible() || clips.revision() == clip_revisions_.published) {
    return;
  }
  ClipState state;
  state.stamp = stampers_.clip.Next(tick.stamp_ns);
  state.scene_hash = scene_.hash;
  clips.Fill(&state);
  // Repeated in the next tick if it was not sent.
  if (ports_.clips.Write(state)) {
    clip_revisions_.published = clips.revision();
  }
}

void PhysicsNode::FillHealth(Health* health) const {
  const auto add = [health](const std::string& name, double value) { health->metrics.push_back({name, value}); };
  // One warning must not hide another.
  const auto warn = [health](const std::string& text) {
    health->last_error += (health->last_error.empty() ? "" : "; ") + text;
  };
  add("displacement_mm", figures_.displacement_mm.load(std::memory_order_relaxed));
  add("max_displacement_mm", figures_.max_displacement_mm.load(std::memory_order_relaxed));
  add("grasped_particles", figures_.grasped.load(std::memory_order_relaxed));
  add("quarantined", static_cast<double>(figures_.quarantined.load(std::memory_order_relaxed)));
  add("peak_force_N", figures_.peak_force_N.load(std::memory_order_relaxed));
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (!TouchesTissue(scene_.tools[i].kind)) continue;
    add("force" + std::to_string(i) + "_N", figures_.force_N[i].load(std::memory_order_relaxed));
  }
  add("asleep_ticks", static_cast<double>(figures_.asleep_ticks.load(std::memory_order_relaxed)));
  add("topology_edits", static_cast<double>(figures_.topology_edits.load(std::memory_order_relaxed)));
  add("torn_edges", figures_.torn_edges.load(std::memory_order_relaxed));
  if (simulation_.clips().possible()) {
    add("clips", figures_.clips.load(std::memory_order_relaxed));
    add("clips_lost", figures_.clips_lost.load(std::memory_order_relaxed));
    add("clips_refused", figures_.clips_refused.load(std::memory_order_relaxed));
  }
  add("largest_stretch", figures_.largest_stretch.load(std::memory_order_relaxed));
  // The gravest first: Health has room for 255 characters.
  if (const std::uint64_t refused = figures_.topology_refused.load(std::memory_order_relaxed); refused > 0) {
    add("topology_refused", static_cast<double>(refused));
    warn("TopologyState or OpenCells of another scene refused");
  }
  if (const float pace = figures_.pace.load(std::memory_order_relaxed); static_cast<double>(pace) < Pace::kSlow) {
    warn("steps take longer than " + std::to_string(TissueSimulation::kMostStepPeriods) +
         " periods: the tissue moves at " + std::to_string(std::lround(100 * pace)) + " % of real time");
  }
  std::string limited;
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    if ((figures_.limited.load(std::memory_order_relaxed) >> i & 1u) == 0) continue;
    limited += (limited.empty() ? "" : ", ") + std::to_string(i);
  }
  if (!limited.empty()) {
    warn("force on tool " + limited + " limited to " + std::to_string(static_cast<int>(ContactProbe::kForceCap_N)) +
         " N");
  }
  const auto [stretch, limit] = figures_.nearest_to_tearing.load(std::memory_order_relaxed);
  if (limit > 0 && stretch > TearWatch::kNear * limit) {
    char text[64];
    std::snprintf(text, sizeof(text), "membrane near tearing: stretch %.2f of %.2f", static_cast<double>(stretch),
                  static_cast<double>(limit));
    warn(text);
  }
  if (const std::uint32_t cheaper = figures_.cheaper.load(std::memory_order_relaxed); cheaper > 0) {
    add("cheaper_presets", cheaper);
    warn("steps ran late: a cheaper preset for the next seconds");
  }
  if (const std::uint64_t lost = figures_.lost_periods.load(std::memory_order_relaxed); lost > 0) {
    add("time_lost_s", static_cast<double>(lost) * static_cast<double>(scene_.physics.dt_s));
  }
}

}  // namespace fulcrum::physics
