#include "thermal_node/node/thermal_node.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include "services/base/core/hash.h"
#include "services/base/runtime/realtime.h"
#include "thermal_node/coupling/tip_parts.h"

namespace fulcrum::thermal {
namespace {

/// A restarted process receives contacts that are older than its first HandleState. It applies them only when the
/// pedal's state is known, but waits at most this long [ns].
constexpr std::int64_t kPedalWait_ns = 300'000'000;

/// State of the node, stored before the solver's part of a checkpoint.
struct NodeState {
  TipTracker::State tip, solid_tip;
  GeneratorInputs::State generator;
  std::uint64_t solver_bytes;  ///< The rest is that of the solids.
  Index solid_chart;
  std::uint32_t unused;
};

}  // namespace

ThermalNode::ThermalNode(const SceneView& scene, const Ports& ports, runtime::CheckpointFile* checkpoint,
                         std::int64_t epoch_ns)
    : scene_(scene),
      ports_(ports),
      checkpoint_(checkpoint),
      solver_(scene_),
      tracker_(solver_.field().sheet(), scene_.thermal.hook_radius_m),
      planner_(solver_.field(), scene_.membrane.texel_m),
      topology_stamper_(epoch_ns),
      open_stamper_(epoch_ns),
      patch_stamper_(epoch_ns),
      event_stamper_(epoch_ns),
      manifest_stamper_(epoch_ns) {
  if (SolidsBurn(scene_)) {
    solids_ = std::make_unique<SolidSurface>(scene_);
    solid_tracker_.emplace(solids_->field().sheet(), scene_.thermal.hook_radius_m, BurntSurface::kSolids);
    solid_planner_.emplace(solids_->field(), kSolidCell_m);
  }
  topology_.scene_hash = scene_.hash;
  topology_.rows = scene_.membrane.rows;
  topology_.cols = scene_.membrane.cols;
  manifest_.node = NodeId::kThermal;
  contacts_.reserve(kMostSamples);
  tips_.reserve(kMostSamples);
  solid_tips_.reserve(kMostSamples);
  manifest_.consumed.reserve(4 * kMostSamples + 1);
  if (checkpoint_ != nullptr) {
    if (const auto latest = checkpoint_->Latest()) restored_ = Restore(latest->payload);
  }
  NoteHealth();
}

void ThermalNode::Step(const Tick& tick) {
  if (ticks_ == 0) {
    runtime::FlushDenormals();
    wait_until_ns_ = tick.stamp_ns + kPedalWait_ns;
  }
  ++ticks_;
  TakeGeneratorInputs(tick);
  TakeContacts(tick);
  TakeTears();
  solver_.Step(tips_, static_cast<float>(tick.dt_s));
  StepSolids(tick.dt_s);
  CollapseFilm(tick.dt_s);
  // The manifest is published before the checkpoint is written: so a recording has the manifest of every tick that a
  // checkpoint can hold, and a replay derives from the first state hash after a restart whether the last tick was in
  // the checkpoint.
  PublishManifest(tick);
  SaveCheckpoint();
  PublishTopology(tick);
  PublishOpenCells(tick);
  PublishEvents(tick);
  PublishPatch(tick);
  if (HealthIsOld()) NoteHealth();
}

void ThermalNode::StepSolids(double dt_s) {
  if (solids_ == nullptr) return;
  Interface hook = solver_.source()->interface();
  solids_stepped_ = solids_->Step(solid_tips_, static_cast<float>(dt_s), &hook);
  if (solids_stepped_) solver_.source()->SetInterface(hook);
}

/// Tissue that is heated forms and holds the film (SourceWindow::Run); elsewhere nothing boils.
void ThermalNode::CollapseFilm(double dt_s) {
  Interface hook = solver_.metal();
  if (hook.film == 0.0f || tips_.empty()) return;
  const auto acts = [&](const TipInput& tip) { return Acts(tip, hook.hook_theta); };
  if (std::ranges::any_of(tips_, acts) || std::ranges::any_of(solid_tips_, acts)) return;
  hook.Follow(0.0f, false, Duration(tips_, static_cast<float>(dt_s)));
  solver_.source()->SetInterface(hook);
}

void ThermalNode::TakeGeneratorInputs(const Tick& tick) {
  bool received = false;
  while (ports_.handles.TakeNext(&handles_)) {
    generator_.Add(handles_);
    received = true;
  }
  while (ports_.generator.TakeNext(&setting_)) generator_.Add(setting_);
  if (ticks_ == 1) waits_ = restored_;
  waits_ = waits_ && !received && tick.stamp_ns < wait_until_ns_;
}

bool ThermalNode::Accepts(const CauteryContact& sample) const {
  if (!tracker_.Accepts(sample)) return false;
  if (!sample.on_solid || !solid_tracker_) return true;
  return solid_tracker_->Accepts(sample) && solids_->IsOn(sample.triangle, sample.material);
}

void ThermalNode::TakeContacts(const Tick& tick) {
  tips_.clear();
  solid_tips_.clear();
  contacts_.clear();
  manifest_.consumed.clear();
  if (waits_) return;
  CauteryContact next;
  while (contacts_.size() < kMostSamples && ports_.contact.TakeNext(&next)) {
    if (!Accepts(next)) {
      ++refused_;
      continue;
    }
    if (tracker_.Repeats(next)) continue;
    contacts_.push_back(next);
  }
  for (const CauteryContact& contact : contacts_) {
    const double ago_s = tick.session_time_s - contact.session_time_s;
    const std::int64_t ns = tick.stamp_ns - std::llround(1e9 * std::clamp(ago_s, -1.0, 1e4));
    const GeneratorDemand demand = generator_.At(ns, &manifest_.consumed);
    generator_.DropBefore(ns);
    no_setting_ = demand.mode != CauteryMode::kOff && !generator_.has_setting();
    tips_.push_back(tracker_.Advance(contact, demand, tick.dt_s));
    if (solids_ != nullptr) solid_tips_.push_back(AdvanceOnSolids(contact, demand, tick.dt_s));
    manifest_.consumed.push_back({TopicId::kCauteryContact, contact.stamp.epoch, contact.stamp.sequence});
  }
}

/// Charts that are neighbours in the atlas need not be neighbours on the solid.
TipInput ThermalNode::AdvanceOnSolids(const CauteryContact& sample, const GeneratorDemand& demand, double dt_s) {
  if (sample.on_solid) {
    const Index chart = solids_->ChartOf(sample.triangle);
    if (chart != solid_chart_) solid_tracker_->BreakPath();
    solid_chart_ = chart;
  }
  return solid_tracker_->Advance(sample, demand, dt_s);
}

std::size_t ThermalNode::CheckpointCapacity(const SceneView& scene) {
  return sizeof(NodeState) + ThermalSolver::CheckpointCapacity(scene) +
         (SolidsBurn(scene) ? SolidSurface::CheckpointCapacity() : 0);
}

bool ThermalNode::Restore(std::span<const std::byte> checkpoint) {
  NodeState state;
  if (checkpoint.size() < sizeof(state)) return false;
  std::memcpy(&state, checkpoint.data(), sizeof(state));
  // Restored as a whole or not at all: the tip's path must continue where the solver's cut ends.
  TipTracker tracker = tracker_;
  GeneratorInputs generator = generator_;
  std::optional<TipTracker> solid_tracker = solid_tracker_;
  const std::span<const std::byte> rest = checkpoint.subspan(sizeof(state));
  if (state.solver_bytes > rest.size()) return false;
  if (!tracker.Restore(state.tip) || !generator.Restore(state.generator) ||
      (solid_tracker && !solid_tracker->Restore(state.solid_tip)) ||
      (solids_ != nullptr && !solids_->Restore(rest.subspan(state.solver_bytes)))) {
    return false;
  }
  if (!solver_.Restore(rest.first(state.solver_bytes))) {
    if (solids_ != nullptr) solids_->Clear();
    return false;
  }
  solid_chart_ = state.solid_chart;
  return tracker_.Restore(state.tip) && generator_.Restore(state.generator) &&
         (!solid_tracker_ || solid_tracker_->Restore(state.solid_tip));
}

/// Each message holds the whole state, so a lost or a repeated one has no effect.
void ThermalNode::TakeTears() {
  if (!ports_.tears.TakeLatest(&tears_)) return;
  manifest_.consumed.push_back({TopicId::kTearState, tears_.stamp.epoch, tears_.stamp.sequence});
  if (tears_.scene_hash != scene_.hash || tears_.rows != scene_.membrane.rows || tears_.cols != scene_.membrane.cols) {
    ++refused_;
    return;
  }
  solver_.Tear(tears_.torn_edges);
}

/// Called before a new revision is published, so every revision that a reader has seen survives a restart.
void ThermalNode::SaveCheckpoint() {
  if (checkpoint_ == nullptr || !(solver_.stepped() || solids_stepped_)) return;
  ++frames_since_checkpoint_;
  const bool due = solver_.committed() || frames_since_checkpoint_ >= kFramesPerCheckpoint;
  // A solver that rests has nothing staged.
  if (!due || (solver_.stepped() && !solver_.at_commit_frame())) return;
  const std::span<std::byte> slot = checkpoint_->Begin();
  const std::span<std::byte> room = slot.subspan(sizeof(NodeState));
  const std::size_t solids_room = solids_ != nullptr ? SolidSurface::CheckpointCapacity() : 0;
  const std::size_t bytes = solver_.Save(room.first(room.size() - solids_room));
  std::size_t solid_bytes = bytes > 0 && solids_ != nullptr ? solids_->Save(room.subspan(bytes)) : 0;
  checkpoint_full_ = bytes == 0 || (solids_ != nullptr && solid_bytes == 0);
  // Without room for the solids' burns the membrane is saved all the same.
  if (bytes > 0 && checkpoint_full_) solid_bytes = SolidSurface::SaveNothing(room.subspan(bytes));
  if (bytes > 0) {
    NodeState state{};
    state.tip = tracker_.Save();
    if (solid_tracker_) state.solid_tip = solid_tracker_->Save();
    state.generator = generator_.Save();
    state.solver_bytes = bytes;
    state.solid_chart = solid_chart_;
    std::memcpy(slot.data(), &state, sizeof(state));
    checkpoint_->Commit(sizeof(state) + bytes + solid_bytes);
  }
  frames_since_checkpoint_ = 0;
}

void ThermalNode::PublishTopology(const Tick& tick) {
  topology_due_ = topology_due_ || solver_.committed() || topology_.cut_length_m != solver_.cut_length_m();
  if (!topology_due_) return;
  const MeshTopology& mesh = solver_.topology();
  topology_.stamp = topology_stamper_.Next(tick.stamp_ns);
  topology_.revision = mesh.revision();
  topology_.cut_length_m = solver_.cut_length_m();
  topology_.cut_width_m = solver_.figures().cut_width_p95_m;
  topology_.cut_off_way_m = solver_.figures().cut_off_way_m;
  topology_.dead_nodes = mesh.committed().dead_nodes;
  topology_.dead_edges = mesh.committed().dead_edges;
  topology_.shrink = mesh.committed().shrink;
  // If the write fails it is repeated in the next tick.
  topology_due_ = !ports_.topology.Write(topology_);
}

void ThermalNode::PublishOpenCells(const Tick& tick) {
  if (contacts_.empty() || !contacts_.back().touching || !ports_.open_cells.has_readers()) return;
  FillOpenCells(solver_.field(), contacts_.back().material, &open_now_);
  if (open_now_.x == open_cells_.x && open_now_.y == open_cells_.y && open_now_.rows == open_cells_.rows) return;
  open_now_.scene_hash = scene_.hash;
  open_now_.stamp = open_stamper_.Next(tick.stamp_ns);
  if (ports_.open_cells.Write(open_now_)) open_cells_ = open_now_;
}

void ThermalNode::PublishEvents(const Tick& tick) {
  for (const SolverEvent& event : solver_.events()) PublishEvent(tick, event);
  if (!solids_stepped_) return;
  for (const SolidWarning& warning : solids_->warnings()) {
    const std::optional<ThermalEventKind> kind = WarningOf(warning.solid);
    if (!kind) continue;
    PublishEvent(tick, {*kind, warning.material, warning.temperature_C, 0.0f},
                 static_cast<std::uint8_t>(warning.solid));
  }
  for (const SolidBurn& burn : solids_->burns()) {
    const SolverEvent event{ThermalEventKind::kSolidBurn, burn.material, burn.temperature_C, burn.dead_m2};
    PublishEvent(tick, event, static_cast<std::uint8_t>(burn.solid));
    // The damage integral of dead surface is 1.
    const std::optional<ThermalEventKind> injury = InjuryOf(burn.solid);
    if (burn.first && injury) {
      PublishEvent(tick, {*injury, burn.material, burn.temperature_C, 1.0f}, static_cast<std::uint8_t>(burn.solid));
    }
  }
}

/// Dead surface is an injury of a ureter or nerve.
std::optional<ThermalEventKind> ThermalNode::InjuryOf(Index solid) const {
  if (solid >= scene_.solids.size()) return std::nullopt;
  const SolidLook look = scene_.solids[solid].look;
  if (look == SolidLook::kUreter) return ThermalEventKind::kUreterInjury;
  if (look == SolidLook::kNerve) return ThermalEventKind::kNerveInjury;
  return std::nullopt;
}

std::optional<ThermalEventKind> ThermalNode::WarningOf(Index solid) const {
  const std::optional<ThermalEventKind> injury = InjuryOf(solid);
  if (!injury) return std::nullopt;
  return *injury == ThermalEventKind::kUreterInjury ? ThermalEventKind::kUreterWarning
                                                    : ThermalEventKind::kNerveWarning;
}

void ThermalNode::PublishEvent(const Tick& tick, const SolverEvent& event, std::uint8_t solid) {
  ThermalEvent message;
  message.stamp = event_stamper_.Next(tick.stamp_ns);
  message.session_time_s = tick.session_time_s;
  message.kind = event.kind;
  message.material = event.material;
  message.temperature_C = event.temperature_C;
  message.value = event.value;
  message.solid = solid;
  message.topology_revision = solver_.topology().revision();
  ports_.event.Write(message);
}

void ThermalNode::PublishPatch(const Tick& tick) {
  patch_note_due_ = patch_note_due_ || solver_.stepped() || solids_stepped_;
  patch_due_ = patch_due_ || ticks_ % kTicksPerPatch == 0;
  history_due_ = history_due_ || ticks_ % kTicksPerHistoryPatch == 0;
  // Frames that commit have the most work already.
  if (!patch_due_ || (solver_.stepped() && solver_.at_commit_frame())) return;
  patch_due_ = false;
  const bool readers = ports_.patch.has_readers();
  const bool new_reader = readers && !patch_readers_;
  patch_readers_ = readers;
  if (!readers) return;
  const std::optional<NextPatch> next = ChoosePatch(new_reader);
  if (!next) return;
  const PatchPlace& place = next->place;
  const bool of_solids = next->surface == BurntSurface::kSolids;
  ports_.patch.WriteInPlace([&](TemperaturePatch::View view) {
    view.header.stamp = patch_stamper_.Next(tick.stamp_ns);
    view.header.topology_revision = solver_.topology().revision();
    view.header.surface = next->surface;
    // Slots of their own: a reader knows a place by its slot.
    view.header.slot = static_cast<std::uint16_t>(place.slot + (of_solids ? kPatchSlots : 0));
    view.header.origin_x = place.origin_x;
    view.header.origin_y = place.origin_y;
    view.header.max_temperature_C = of_solids ? DrawPatch(solids_->field(), kSolidCell_m, place, view.texels)
                                              : DrawPatch(solver_.field(), scene_.membrane.texel_m, place, view.texels);
  });
}

std::optional<ThermalNode::NextPatch> ThermalNode::ChoosePatch(bool new_reader) {
  if (patch_note_due_ || new_reader) {
    planner_.Note(solver_.mutable_field(), new_reader);
    if (solids_ != nullptr) solid_planner_->Note(solids_->mutable_field(), new_reader);
  }
  patch_note_due_ = false;
  solids_turn_ = !solids_turn_ && solids_ != nullptr;
  std::optional<PatchPlace> place;
  BurntSurface surface = BurntSurface::kMembrane;
  for (const bool history : {false, true}) {
    if (place || (history && !history_due_)) continue;
    for (const bool of_solids : {solids_turn_, !solids_turn_}) {
      if (place || (of_solids && solids_ == nullptr)) continue;
      PatchPlanner& planner = of_solids ? *solid_planner_ : planner_;
      surface = of_solids ? BurntSurface::kSolids : BurntSurface::kMembrane;
      place = history     ? planner.NextOfHistory()
              : of_solids ? planner.Next(solids_->field())
                          : planner.Next(solver_.field());
    }
  }
  history_due_ = false;
  if (!place) return std::nullopt;
  return NextPatch{surface, *place};
}

void ThermalNode::PublishManifest(const Tick& tick) {
  if (!ports_.manifest.has_readers()) return;
  manifest_.stamp = manifest_stamper_.Next(tick.stamp_ns);
  manifest_.tick = tick.index;
  manifest_.session_time_s = tick.session_time_s;
  manifest_.state_hash = StateHash();
  ports_.manifest.Write(manifest_);
}

/// Solids that were never heated leave the hash as it is.
std::uint64_t ThermalNode::StateHash() const {
  const std::uint64_t of_solids = solids_ != nullptr ? solids_->TickHash() : 0;
  if (of_solids == 0) return solver_.TickHash();
  Hash64 hash;
  hash.AddValue(solver_.TickHash());
  hash.AddValue(of_solids);
  return hash.value();
}

bool ThermalNode::HealthIsOld() const {
  // The hook cools on above cold tissue.
  const bool cooler = ticks_ % kTicksPerClosure == 0 && solver_.figures().hook_C != noted_hook_C_;
  // Once more after the last step, with the power 0.
  return solver_.stepped() || solids_stepped_ || noted_step_ || no_setting_ != noted_no_setting_ ||
         refused_ != noted_refused_ || cooler;
}

void ThermalNode::NoteHealth() {
  noted_step_ = solver_.stepped() || solids_stepped_;
  noted_no_setting_ = no_setting_;
  noted_refused_ = refused_;
  noted_hook_C_ = solver_.figures().hook_C;
  Figures f{};
  f.solver = solver_.figures();
  f.delivered_J = solver_.ledger().generator;
  if (solids_ != nullptr) {
    f.delivered_J += solids_->ledger().generator;
    f.solids_dead_m2 = solids_->dead_m2();
    for (Index solid = 0; solid < scene_.solids.size(); ++solid) {
      if (!InjuryOf(solid)) continue;
      f.solver.injuries += solids_->reported(solid) ? 1 : 0;
      f.solver.warnings += solids_->warned(solid) ? 1 : 0;
    }
    f.solver.highest_C = std::max(f.solver.highest_C, solids_->highest_C());
    f.solver.present_C = std::max(f.solver.present_C, scene_.thermal.body_temperature_C + solids_->field().MaxTheta());
    f.solver.power_W += solids_->power_W();
    f.solver.voltage_V = std::max(f.solver.voltage_V, solids_->voltage_V());
    f.solver.set_power_W = std::max(f.solver.set_power_W, solids_->set_power_W());
    f.solver.shortened += solids_->shortened();
  }
  // The sum over all cells takes as long as a substep of conduction, so it is not computed in every tick.
  if (ticks_ % kTicksPerClosure == 0) {
    closure_ = solver_.ledger().ClosureError(solver_.field().Stored());
    if (solids_ != nullptr) closure_ = std::max(closure_, solids_->ledger().ClosureError(solids_->field().Stored()));
  }
  f.closure = closure_;
  f.revision = solver_.topology().revision();
  f.quarantined = solver_.field().quarantined() + (solids_ != nullptr ? solids_->field().quarantined() : 0);
  f.no_place = solids_ != nullptr && solids_->left_out() > 0.0f ? 1 : 0;
  f.refused = refused_;
  f.dead_edges = solver_.topology().dead_edge_count();
  f.dead_nodes = solver_.topology().dead_node_count();
  f.awake_tiles = static_cast<std::uint32_t>(solver_.field().awake().size());
  f.checkpoint_full = checkpoint_full_ ? 1 : 0;
  f.no_setting = no_setting_ ? 1 : 0;
  setting_changed_ = setting_changed_ || f.solver.set_power_W != set_power_W_;
  set_power_W_ = f.solver.set_power_W;
  f.cut_length_m = solver_.cut_length_m();
  figures_.Store(f);
}

void ThermalNode::FillHealth(Health* health) const {
  const Figures f = figures_.Load();
  health->metrics = {{"highest_temperature_C", f.solver.highest_C},
                     {"temperature_C", f.solver.present_C},
                     {"cut_length_mm", 1e3 * f.cut_length_m},
                     {"burn_depth_mm", 1e3 * f.solver.burn_depth_m},
                     {"dead_edges", static_cast<double>(f.dead_edges)},
                     {"dead_nodes", static_cast<double>(f.dead_nodes)},
                     {"warnings", static_cast<double>(f.solver.warnings)},
                     {"injuries", static_cast<double>(f.solver.injuries)},
                     {"cut_width_p50_mm", 1e3 * f.solver.cut_width_p50_m},
                     {"cut_width_p95_mm", 1e3 * f.solver.cut_width_p95_m},
                     {"cut_off_way_mm", 1e3 * f.solver.cut_off_way_m},
                     {"debris_mm2", 1e6 * f.solver.debris_m2},
                     {"solid_burn_mm2", 1e6 * f.solids_dead_m2},
                     {"hook_temperature_C", f.solver.hook_C},
                     {"set_power_W", f.solver.set_power_W},
                     {"power_W", f.solver.power_W},
                     {"voltage_V", f.solver.voltage_V},
                     {"delivered_J", f.delivered_J},
                     {"energy_closure", f.closure},
                     {"topology_revision", static_cast<double>(f.revision)},
                     {"awake_tiles", static_cast<double>(f.awake_tiles)},
                     {"quarantined_cells", static_cast<double>(f.quarantined)},
                     {"contacts_refused", static_cast<double>(f.refused)}};
  if (f.solver.shortened > 0) {
    health->last_error =
        "metal longer than the window of the potential: shortened in " + std::to_string(f.solver.shortened) + " frames";
  }
  if (f.no_place != 0) {
    health->last_error = "part of the organs' surface cannot be burnt: their surface is larger than its atlas";
  }
  if (f.no_setting != 0) {
    health->last_error = "a pedal is down, but no GeneratorSetting has come: no current. The supervisor sends it";
  }
  if (f.checkpoint_full != 0) health->last_error = "checkpoint has no room for the tissue that was heated";
}

}  // namespace fulcrum::thermal
