#include "render_node/node/render_node.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <osgGA/GUIEventAdapter>
#include <string>
#include <utility>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "render_node/node/camera_keys.h"
#include "render_node/node/hands_view.h"
#include "services/base/core/contact_force.h"
#include "services/base/core/generator_inputs.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/quantiles.h"

namespace fulcrum::render {
namespace {

constexpr float kFollowed = 2e-5f;   // [m]: a camera that follows a tool does not move by less.
constexpr float kSameForce = 0.05f;  // [N]: half of the resolution of the displayed figure.
constexpr float kBoils_C = 90;       // Highest temperature of a patch above which there is steam.
constexpr double kTextLife_s = 4.0;  // Duration for which a temperature or a warning is shown.
constexpr double kLate_s = 0.3;      // Timeout of topics with a rate of 100 Hz.

}  // namespace

RenderNode::RenderNode(const SceneView& scene, const RenderSettings& settings, const RenderPorts& ports,
                       std::unique_ptr<Stage> stage)
    : scene_(scene),
      roll_references_(RollReferences(scene)),
      window_(settings.window),
      ports_(ports),
      stage_(stage ? std::move(stage) : std::make_unique<Stage>(scene, settings.window, settings.look)),
      view_(stage_->view),
      display_(*stage_->display),
      shape_{0, 0, static_cast<int>(scene.render.width), static_cast<int>(scene.render.height)},
      outlet_(settings.frames, settings.keep_free_B, ports.pictures),
      quality_(settings.quality, static_cast<int>(scene.render.height), display_.is_gpu()),
      smooths_(settings.quality == Quality::kHigh && display_.can_smooth()),
      operator_stamper_(runtime::MonotonicNs()),
      picture_stamper_(runtime::MonotonicNs()),
      camera_(scene.render),
      lens_(scene),
      figures_(scene.render.hud != 0) {
  view_.SetMostScale(quality_.most());
  hud_.tube = FindTool(scene.tools, ToolKind::kSuction).has_value();
  hud_.clip_applier = FindTool(scene.tools, ToolKind::kClipApplier).has_value();
  if (ports_.operator_input == nullptr) return;
  const auto write = [this](const OperatorInput& input) {
    OperatorInput stamped = input;
    stamped.stamp = operator_stamper_.Next(input.stamp.stamp_ns);
    ports_.operator_input->Write(stamped);
  };
  hands_ = std::make_unique<WindowInput>("", display_.window(), write, settings.inputs);
  hud_.hands = HandsState();
  hud_.gamepad = settings.inputs.gamepad;
}

RenderNode::~RenderNode() = default;

std::int64_t RenderNode::PeriodNs(std::int64_t cart_ns) const {
  const auto scene_ns = static_cast<std::int64_t>(std::llround(1e9 / static_cast<double>(scene_.render.rate_Hz)));
  return hands_ || !window_ ? cart_ns : std::max(cart_ns, scene_ns);
}

void RenderNode::Step(const Tick& tick) {
  session_time_s_ = tick.session_time_s;
  outlet_.Collect(false, &display_);
  TakeKeys();
  TakeSize();
  if (hud_.paused) {
    PassOver();
  } else {
    TakeTissue();
    TakeClips();
    TakeThermal();
    TakeEvents();
    TakeTools();
    TakeGenerator();
    TakeContact();
    TakeForces();
    FindLate();
  }
  UpdateHands();
  if (!ready()) return;
  if (view_.HasFaded(session_time_s_)) changed_on_screen_ = changed_in_file_ = true;
  // A new reader receives a picture even if nothing moves.
  const bool streamed = std::exchange(streams_, outlet_.has_readers());
  if (streams_ && !streamed) changed_on_screen_ = true;
  const bool write = outlet_.has_folder() && (screenshot_ || (changed_in_file_ && session_time_s_ >= next_png_s_));
  screenshot_ = false;
  const bool refined = (window_ || streams_) && view_.Refine();  // Also with a text that changes at each step.
  const bool live = refined || ((window_ || streams_) && changed_on_screen_);
  if (write || live) {
    Draw(session_time_s_, write);
  } else if (view_.TubesWork()) {
    FollowEffects();
  }
}

void RenderNode::FollowEffects() {
  if (!ready()) return;
  const bool cleared = view_.HasFaded(session_time_s_);
  if (!view_.UpdateEffects(session_time_s_) && !cleared) return;
  changed_on_screen_ = changed_in_file_ = true;
  view_.Update();  // Blood runs down the present shape, and steam rises from it.
}

bool RenderNode::DrawInto(Bitmap* picture) {
  if (!ready() || !changed_on_screen_) return false;
  Draw(session_time_s_, false, ReadBack::kAlways);
  *picture = picture_;
  return true;
}

void RenderNode::DrawFrom(const RenderParams& camera, Bitmap* picture) {
  (void)view_.UpdateEffects(session_time_s_);
  view_.SetSmoothed(false);     // A data set depends on no earlier picture.
  view_.SetSmoothEdges(false);  // Its masks have edges between pixels.
  view_.SetCamera(camera);
  view_.SetScale(quality_.scale());
  view_.SetTexts({});
  view_.Update();
  display_.DrawAndRead(picture);
  view_.SetCamera(camera_.params());
}

void RenderNode::Finish() {
  if (outlet_.has_folder() && ready() && changed_in_file_) {
    Draw(session_time_s_, true);
  }
  outlet_.Collect(true, &display_);
}

void RenderNode::WaitForFiles() {
  outlet_.Collect(true, &display_);
  outlet_.WaitForFiles();
}

void RenderNode::TakeTissue() {
  if (!ports_.tissue.TakeLatest(&new_tissue_)) return;
  arrivals_[0].time_s = session_time_s_;
  arrivals_[0].silence_s = new_tissue_.header.next_within_s;
  if (new_tissue_.header.scene_hash != scene_.hash || new_tissue_.xyz.size() < 3 * scene_.rest_position.size()) {
    Report("TissueFrame of another scene dropped");
    return;
  }
  const TissueFrameHeader &now = new_tissue_.header, &last = tissue_.header;
  if (now.stamp.epoch == last.stamp.epoch) {
    pace_.Add(now.simulated_time_s - last.simulated_time_s, now.session_time_s - last.session_time_s);
  }
  const bool moved = new_tissue_.xyz != tissue_.xyz;
  std::swap(tissue_, new_tissue_);
  if (moved) {
    view_.SetTissue(std::span<const float>(tissue_.xyz).first(3 * scene_.rest_position.size()));
  }
  if (view_.SetBreath(tissue_.header.simulated_time_s) || moved) {
    changed_on_screen_ = changed_in_file_ = true;
  }
}

void RenderNode::TakeClips() {
  if (!ports_.clips.TakeLatest(&clips_)) return;
  if (clips_.scene_hash != scene_.hash) {
    Report("ClipState of another scene dropped");
    return;
  }
  std::vector<Clip> on_tissue;
  for (const Clip& clip : std::span(clips_.clips).first(clips_.count)) {
    const bool known =
        std::ranges::all_of(clip.anchors, [this](std::uint32_t v) { return v < scene_.rest_position.size(); });
    if (known) {
      on_tissue.push_back(clip);
    } else {
      clips_dropped_.fetch_add(1, std::memory_order_relaxed);
      Report("clip on a vertex that the scene does not have");
    }
  }
  hud_.clips = static_cast<int>(on_tissue.size());
  view_.SetClips(on_tissue);
  changed_on_screen_ = changed_in_file_ = true;
}

// Samples that wait too long unread would count as lost. Of the streams the newest is read after the pause, but each
// patch shows another place, an event tells of an injury or a vessel that bleeds from then on, and a tube whose handle
// is let go must stop.
void RenderNode::PassOver() {
  // On the page the controls are taken by the header of the newest picture.
  const std::array<ToolSample, kMaxTools> before = new_tools_.tools;
  if (ports_.tools.TakeLatest(&new_tools_)) {
    const auto is_there = [](const ToolSample& a, const ToolSample& b) { return a.p_WT == b.p_WT; };
    changed_on_screen_ = changed_on_screen_ || (streams_ && !std::ranges::equal(before, new_tools_.tools, is_there));
  }
  if (!hud_.tube) (void)ports_.handles.TakeLatest(&new_handles_);
  while (hud_.tube && ports_.handles.TakeNext(&new_handles_)) FollowValves();
  (void)ports_.contacts.TakeLatest(&contact_);
  (void)ports_.contact_models.TakeLatest(&contact_model_);
  while (ports_.patches.TakeNext(&patch_)) held_patches_[PlaceOf(patch_.header)] = patch_;
  while (ports_.events.TakeNext(&event_)) held_events_.push_back(event_);
}

void RenderNode::TakeThermal() {
  // The first one also if nothing is cut: all that is cut later is then known to come with patches.
  const bool first = topology_.stamp.sequence == 0;
  const std::uint64_t known = topology_.revision;
  if (ports_.topology.TakeLatest(&topology_) && (first || topology_.revision != known)) {
    if (topology_.scene_hash != scene_.hash || !view_.SetTopology(topology_)) {
      Report("TopologyState of another scene dropped");
    } else {
      changed_on_screen_ = changed_in_file_ = true;
    }
  }
  for (const auto& [place, patch] : held_patches_) Apply(patch);
  held_patches_.clear();
  while (ports_.patches.TakeNext(&patch_)) Apply(patch_);
}

void RenderNode::Apply(const TemperaturePatch& patch) {
  if (!view_.ApplyPatch(patch)) return;
  heat_[static_cast<std::size_t>(patch.header.surface)] = {session_time_s_, patch.header.max_temperature_C};
  patches_applied_.fetch_add(1, std::memory_order_relaxed);
  changed_on_screen_ = changed_in_file_ = true;
}

void RenderNode::TakeEvents() {
  for (const ThermalEvent& event : held_events_) Apply(event);
  held_events_.clear();
  while (ports_.events.TakeNext(&event_)) Apply(event_);
}

void RenderNode::Apply(const ThermalEvent& event) {
  switch (event.kind) {
    case ThermalEventKind::kCut:
      view_.OpenVessels(event.material, event.session_time_s);
      [[fallthrough]];
    case ThermalEventKind::kSteam:
    case ThermalEventKind::kChar:
      view_.AddSmoke(event.material, event.session_time_s);
      break;
    case ThermalEventKind::kUreterWarning:
    case ThermalEventKind::kUreterInjury:
      warned_s_[0] = event.session_time_s;
      injured_[0] = injured_[0] || event.kind == ThermalEventKind::kUreterInjury;
      break;
    case ThermalEventKind::kNerveWarning:
    case ThermalEventKind::kNerveInjury:
      warned_s_[1] = event.session_time_s;
      injured_[1] = injured_[1] || event.kind == ThermalEventKind::kNerveInjury;
      break;
    default:
      break;
  }
  changed_on_screen_ = changed_in_file_ = true;
}

bool RenderNode::Recent(double time_s) const { return session_time_s_ - time_s < kTextLife_s; }

void RenderNode::UpdateTexts() {
  hud_.session_time_s = session_time_s_;
  hud_.pedals = handles_.pedals;
  hud_.force_limit_N = ForceLimit(scene_);
  hud_.slit_m = topology_.cut_length_m;
  hud_.tip_C = HottestRecent();
  for (std::size_t k = 0; k < kMaxTools; ++k) {
    const bool there = TouchesTissue(tools_.tools[k].kind);
    hud_.force_N[k] = there ? std::optional(force_N_[k]) : std::nullopt;
    hud_.assists[k] = scene_.tools[k].assists();
  }
  const auto alarm = [this](std::size_t k) {
    return injured_[k] ? Alarm::kInjured : Recent(warned_s_[k]) ? Alarm::kHot : Alarm::kNone;
  };
  hud_.ureter = alarm(0);
  hud_.nerve = alarm(1);
  view_.SetTexts(HudTexts(hud_, figures_));
}

// The picture keeps showing the last state and marks it as late.
void RenderNode::FindLate() {
  std::vector<std::string> late;
  for (const Arrival& arrival : arrivals_) {
    if (arrival.time_s >= 0 && session_time_s_ - arrival.time_s > arrival.silence_s + kLate_s) {
      late.emplace_back(arrival.text);
    }
  }
  if (pace_.value() < Pace::kSlow) {
    late.push_back("TISSUE AT " + std::to_string(5 * std::lround(20 * pace_.value())) + " % SPEED");
  }
  if (late != hud_.late) {
    hud_.late = std::move(late);
    changed_on_screen_ = changed_in_file_ = true;
  }
}

void RenderNode::TakeGenerator() {
  (void)ports_.generator.TakeLatest(&generator_);
  const float power_W = PowerOf(generator_, ModeOf(handles_.pedals));
  if (power_W != hud_.power_W) {
    hud_.power_W = power_W;
    changed_on_screen_ = changed_in_file_ = true;
  }
}

void RenderNode::TakeContact() {
  if (!ports_.contacts.TakeLatest(&contact_)) return;
  // Events report the first steam at a place only; steam continues while power is delivered to boiling tissue.
  const Heat& heat = heat_[contact_.on_solid ? 1 : 0];
  const bool boils = hud_.power_W > 0 && heat.highest_C > kBoils_C && Recent(heat.time_s);
  if (boils && (contact_.touching || contact_.on_solid)) {
    const Vec3f p_W = contact_.on_solid ? tools_.tools[contact_.tool].p_WT : view_.OnMembrane(contact_.material);
    view_.AddSmokeAt(p_W, session_time_s_);
    changed_on_screen_ = changed_in_file_ = true;
  }
}

void RenderNode::TakeForces() {
  if (!ports_.contact_models.TakeLatest(&contact_model_)) return;
  for (std::size_t k = 0; k < kMaxTools; ++k) {
    const auto force_N = static_cast<float>(TissueForce(contact_model_.devices[k]).norm());
    if (std::abs(force_N - force_N_[k]) < kSameForce) continue;
    force_N_[k] = force_N;
    changed_on_screen_ = changed_in_file_ = true;
  }
}

void RenderNode::TakeKeys() {
  for (const int key : display_.TakeKeys()) {
    Press(key);
    changed_on_screen_ = true;
  }
  if (followed_ >= 0) {
    const ToolSample& tool = tools_.tools[static_cast<std::size_t>(followed_)];
    if (tool.kind != ToolKind::kNone && (tool.p_WT - camera_.params().scope_target_W).norm() > kFollowed) {
      camera_.Follow(tool.p_WT);
      view_.SetCamera(camera_.params());
    }
  }
}

void RenderNode::TakeSize() {
  const PixelBox shape = display_.picture();
  if (shape == shape_) return;
  if (shape.width != shape_.width || shape.height != shape_.height) {
    view_.SetSize(shape.width, shape.height);
    quality_.SetHeight(shape.height);
    view_.SetMostScale(quality_.most());
  }
  shape_ = shape;
  changed_on_screen_ = true;
}

HandsView RenderNode::ViewNow() const {
  // Not of what a paused picture shows: who takes the controls begins where the tools are.
  return MakeHandsView(scene_, camera_.params(), shape_.height, new_tools_, new_handles_, roll_references_);
}

PictureHeader RenderNode::HeaderNow() {
  PictureHeader header = MakePictureHeader(ViewNow());
  header.stamp =
      picture_stamper_.Next(tools_.stamp.stamp_ns != 0 ? tools_.stamp.stamp_ns : tissue_.header.stamp.stamp_ns);
  header.session_time_s = session_time_s_;
  header.tool_sequence = tools_.stamp.sequence;
  header.tissue_sequence = tissue_.header.stamp.sequence;
  header.scale = static_cast<float>(quality_.scale());
  return header;
}

void RenderNode::YieldHands() {
  OperatorInput received;
  std::int64_t newest_ns = 0;
  while (ports_.operators != nullptr && ports_.operators->TakeNext(&received)) {
    newest_ns = std::max(newest_ns, received.claim_ns);
  }
  if (newest_ns != 0) hands_->Yield(newest_ns);
}

void RenderNode::UpdateHands() {
  if (!hands_) return;
  if (display_.clicked()) hands_->Take();
  YieldHands();
  hands_->SetView(ViewNow());
  const HandsState state = hands_->state();
  if (state != *hud_.hands) {
    hud_.hands = state;
    changed_on_screen_ = true;
  }
}

void RenderNode::Press(int key) {
  if (const std::optional<CameraKey> camera_key = CameraKeyOf(key)) {
    camera_.Press(*camera_key);
    view_.SetCamera(camera_.params());
    return;
  }
  switch (key) {
    case 'l':
      followed_ = followed_ + 1 < kMaxTools ? followed_ + 1 : -1;
      return;
    case 's':
      screenshot_ = true;
      return;
    case 'p':
      hud_.paused = !hud_.paused;
      return;
    case 'u':
      figures_ = !figures_;
      return;
    case osgGA::GUIEventAdapter::KEY_F11:
      display_.ToggleFullScreen();
      return;
    case 'h':
      hud_.help = !hud_.help;
      return;
    default:
      return;
  }
}

void RenderNode::Draw(double session_time_s, bool write_png, ReadBack read) {
  const auto start = std::chrono::steady_clock::now();
  const bool moving = view_.UpdateEffects(session_time_s);
  view_.SetScale(quality_.scale());
  // A file has no pictures shortly before it, unless a window or a reader of Picture is there, whose pictures it is
  // one of; a GPU draws many samples a pixel.
  view_.SetSmoothed(smooths_ && (window_ || streams_) &&
                    shape_.width * shape_.height <= LaparoscopeView::kMostSmoothed);
  view_.SetSmoothEdges(true);
  view_.Update();
  const bool settles = view_.DrawsBackgroundAtRest();
  UpdateTexts();
  const PictureOutlet::Use use{write_png, streams_, session_time_s, streams_ ? HeaderNow() : PictureHeader()};
  if (read == ReadBack::kIfUsed && !write_png && !streams_) {
    display_.Draw();
  } else if (read == ReadBack::kIfUsed && window_ && display_.is_gpu()) {
    // The window must not wait until a GPU's picture has come into memory.
    outlet_.Collect(true, &display_);
    display_.DrawAndStartRead();
    outlet_.Expect(use);
  } else {
    display_.DrawAndRead(&picture_);
    outlet_.Give(picture_, use);
  }
  if (write_png) {
    const double period = 1.0 / std::max(0.001f, scene_.render.png_rate_Hz);
    next_png_s_ = period * (std::floor(session_time_s / period) + 1);
    changed_in_file_ = moving;
  }
  changed_on_screen_ = moving;
  frames_drawn_.fetch_add(1, std::memory_order_relaxed);
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
  // Of pictures that cost more for one period only, an eye that rests would go on at a coarser scale, and then back.
  if (!settles) quality_.Add(spent.count());
  NoteLatency(spent.count());
  draw_ms_.store(spent.count(), std::memory_order_relaxed);
  scale_.store(quality_.scale(), std::memory_order_relaxed);
  shed_m3_.store(view_.shed_m3(), std::memory_order_relaxed);
}

/// Of a live picture that shows a new shape of the tissue: the age of the poses that made it, when the picture is
/// drawn. A file is drawn when it is due, however long nothing has moved.
void RenderNode::NoteLatency(double draw_ms) {
  const TissueFrameHeader& tissue = tissue_.header;
  const bool is_new = std::exchange(drawn_tissue_, tissue.stamp.sequence) != tissue.stamp.sequence;
  if (!is_new || !(window_ || streams_)) return;
  // A step of physics stands for a whole multiple of its period, a little before the thread woke.
  const auto period_s = static_cast<double>(scene_.physics.dt_s);
  const double pose_s = period_s * std::floor(tissue.session_time_s / period_s + 1e-6);
  const double age_s = session_time_s_ - pose_s + 1e-3 * draw_ms;
  motion_to_picture_.Add(std::llround(1e9 * age_s));
}

void RenderNode::Report(const std::string& error) {
  const std::lock_guard lock(error_mutex_);
  error_ = error;
}

void RenderNode::FillHealth(Health* health) const {
  health->metrics.push_back({"frames_drawn", static_cast<double>(frames_drawn_.load(std::memory_order_relaxed))});
  health->metrics.push_back({"draw_ms", draw_ms_.load(std::memory_order_relaxed)});
  if (const std::uint64_t refused = clips_dropped_.load(std::memory_order_relaxed)) {
    health->metrics.push_back({"clips_dropped", static_cast<double>(refused)});
  }
  if (const double shed_m3 = shed_m3_.load(std::memory_order_relaxed); shed_m3 > 0) {
    health->metrics.push_back({"blood_ul", 1e9 * shed_m3});
  }
  runtime::AddQuantiles("motion_to_picture", motion_to_picture_.snapshot(), health);
  health->metrics.push_back({"scale", scale_.load(std::memory_order_relaxed)});
  health->metrics.push_back({"patches", static_cast<double>(patches_applied_.load(std::memory_order_relaxed))});
  const std::string error = outlet_.FillHealth(health);
  const std::lock_guard lock(error_mutex_);
  health->last_error = error_.empty() ? error : error_;
}

}  // namespace fulcrum::render
