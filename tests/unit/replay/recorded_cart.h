// Physics, thermal and haptics in one process with a clock of their own, recorded like by the recorder.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "haptics_node/node/haptics_node.h"
#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/node/physics_node.h"
#include "services/base/core/operator_script.h"
#include "services/base/runtime/checkpoint.h"
#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/in_process.h"
#include "thermal_node/node/thermal_node.h"

namespace fulcrum::replay::testing {

/// A topic of the cart with a reader that records.
template <class T>
class TappedTopic {
 public:
  explicit TappedTopic(recording::McapWriter* writer) : writer_(writer) {}
  [[nodiscard]] auto MakeInput() { return topic_.MakeInput(); }
  [[nodiscard]] auto MakeOutput() { return topic_.MakeOutput(); }
  /// Records the samples since the last call. `change` may alter a sample before it is recorded, or drop it
  /// (false).
  void Record(std::int64_t now_ns, const std::function<bool(T*)>& change = {}) {
    while (tap_->TakeNext(&sample_)) {
      if (change && !change(&sample_)) continue;
      if (!bus::EncodeCdr(sample_, &bytes_)) continue;
      writer_->Write(ChannelOf(sample_), static_cast<std::uint32_t>(bus::StampOf(sample_).sequence),
                     static_cast<std::uint64_t>(now_ns), static_cast<std::uint64_t>(now_ns),
                     std::as_bytes(std::span(bytes_)));
    }
  }

 private:
  using Process = std::pair<std::string, std::uint64_t>;
  /// One writer for each process that publishes a TickManifest; the other topics need only one here.
  std::uint16_t ChannelOf(const T& sample) {
    Process process;
    recording::TextMap about;
    if constexpr (std::is_same_v<T, TickManifest>) {
      process = {NodeName(sample.node), sample.stamp.epoch};
      about = {{"node", process.first}};
    }
    const auto [known, fresh] = channels_.try_emplace(process);
    if (fresh) known->second = writer_->AddChannel(0, bus::RoleOf<T>().name, "cdr", about);
    return known->second;
  }

  recording::McapWriter* writer_;
  std::map<Process, std::uint16_t> channels_;
  bus::InProcessTopic<T> topic_;
  std::unique_ptr<bus::Input<T>> tap_ = topic_.MakeInput(4096);
  T sample_;
  std::vector<std::uint8_t> bytes_;
};

inline constexpr std::int64_t kCartStart_ns = 1'000'000'000'000;  ///< Begin of the session.

struct CartStory {
  double seconds = 3;
  double kill_physics_s = -1;  ///< Killed without notice, restarted 30 ms later.
  bool kill_before_seal =
      false;  ///< Kills physics after the manifest of its last tick and before that tick's checkpoint.
  double kill_haptics_s = -1;
  double late_physics_s = -1;                            ///< Time at which one period is skipped.
  int threads = 1;                                       ///< Threads of physics.
  float power_W = 35;                                    ///< Power of the generator.
  std::function<bool(ToolState*)> tool_change{};         ///< Applied to the recorded samples only.
  std::function<bool(TickManifest*)> manifest_change{};  ///< The same.
  bool record_frames = true;                             ///< TissueFrame is most of the bytes.
};

/// Restores the state before the newest slot was sealed.
inline void Unseal(runtime::CheckpointFile* file) {
  const auto previous = file->Previous();
  const std::vector<std::byte> bytes(previous->payload.begin(), previous->payload.end());
  std::ranges::copy(bytes, file->Begin().begin());
  file->Commit(bytes.size());
}

/// Runs the cart and records it into `folder`/recording.mcap. Returns the cut length [m].
inline float RecordCart(const SceneView& scene, const std::filesystem::path& folder, const CartStory& story) {
  recording::McapWriter writer(folder / "recording.mcap", "", "test");
  TappedTopic<ToolState> tools(&writer);
  TappedTopic<HandleState> handles(&writer);
  TappedTopic<GeneratorSetting> generator(&writer);
  TappedTopic<OperatorInput> operators(&writer);
  TappedTopic<TissueFrame> frames(&writer);
  TappedTopic<ContactModel> models(&writer);
  TappedTopic<CauteryContact> cautery(&writer);
  TappedTopic<TearState> tears(&writer);
  TappedTopic<ClipState> clips(&writer);
  TappedTopic<TopologyState> topology(&writer);
  TappedTopic<OpenCells> open_cells(&writer);
  TappedTopic<TemperaturePatch> patches(&writer);
  TappedTopic<ThermalEvent> events(&writer);
  TappedTopic<TickManifest> manifests(&writer);
  TappedTopic<SceneManifest> sessions(&writer);

  constexpr std::int64_t kMillisecond = 1'000'000;
  constexpr std::int64_t kStart = kCartStart_ns;
  auto session_out = sessions.MakeOutput();
  SceneManifest session;
  session.stamp = {1, kStart, kStart};
  session.scene_name = scene.name;
  session.session_id = "test";
  session.scene_hash = scene.hash;
  session.session_start_ns = kStart;
  session_out->Write(session);

  struct PhysicsProcess {
    std::unique_ptr<bus::Input<ToolState>> tools;
    std::unique_ptr<bus::Input<HandleState>> handles;
    std::unique_ptr<bus::Input<TopologyState>> topology;
    std::unique_ptr<bus::Input<OpenCells>> open_cells;
    std::unique_ptr<bus::LoanOutput<TissueFrame>> frames;
    std::unique_ptr<bus::Output<ContactModel>> models;
    std::unique_ptr<bus::Output<CauteryContact>> cautery;
    std::unique_ptr<bus::Output<TearState>> tears;
    std::unique_ptr<bus::Output<TickManifest>> manifests;
    std::unique_ptr<bus::Output<ClipState>> clips;
    std::unique_ptr<physics::PhysicsNode> node;
    std::uint64_t ticks = 0;
  };
  runtime::CheckpointFile physics_checkpoint(
      folder / "physics.checkpoint", scene.hash, physics::kCheckpointLayout,
      physics::CheckpointCapacity(static_cast<Index>(scene.rest_position.size())));
  const auto start_physics = [&](std::int64_t epoch) {
    PhysicsProcess p{tools.MakeInput(),
                     handles.MakeInput(),
                     topology.MakeInput(),
                     open_cells.MakeInput(),
                     frames.MakeOutput(),
                     models.MakeOutput(),
                     cautery.MakeOutput(),
                     tears.MakeOutput(),
                     manifests.MakeOutput(),
                     clips.MakeOutput(),
                     nullptr,
                     0};
    p.node = std::make_unique<physics::PhysicsNode>(
        scene,
        physics::PhysicsNode::Ports{*p.tools, *p.handles, *p.topology, *p.open_cells, *p.frames, *p.models, *p.cautery,
                                    *p.tears, *p.manifests, *p.clips},
        &physics_checkpoint, epoch, story.threads);
    return p;
  };
  struct HapticsProcess {
    std::unique_ptr<bus::Input<ContactModel>> models;
    std::unique_ptr<bus::Input<OperatorInput>> operators;
    std::unique_ptr<bus::Output<ToolState>> tools;
    std::unique_ptr<bus::Output<TickManifest>> manifests;
    std::unique_ptr<haptics::HapticsNode> node;
  };
  std::array<bool, kMaxTools> simulated{true, true};
  for (std::size_t k = 2; k < kMaxTools; ++k) simulated[k] = scene.tools[k].kind != ToolKind::kNone;
  const auto start_haptics = [&](std::int64_t epoch) {
    HapticsProcess h{models.MakeInput(), operators.MakeInput(), tools.MakeOutput(), manifests.MakeOutput(), nullptr};
    h.node = std::make_unique<haptics::HapticsNode>(
        scene, simulated, haptics::HapticsNode::Ports{*h.models, *h.operators, *h.tools, *h.manifests}, epoch);
    return h;
  };
  std::optional<PhysicsProcess> physics = start_physics(kStart - 5);
  std::optional<HapticsProcess> haptics = start_haptics(kStart - 4);
  runtime::CheckpointFile thermal_checkpoint(folder / "thermal.checkpoint", scene.hash, thermal::kCheckpointLayout,
                                             thermal::ThermalNode::CheckpointCapacity(scene));
  auto thermal_in = cautery.MakeInput();
  auto tear_in = tears.MakeInput();
  auto thermal_handles_in = handles.MakeInput();
  auto setting_in = generator.MakeInput();
  auto topology_out = topology.MakeOutput();
  auto open_out = open_cells.MakeOutput();
  auto patch_out = patches.MakeOutput();
  auto event_out = events.MakeOutput();
  auto thermal_manifest_out = manifests.MakeOutput();
  thermal::ThermalNode thermal(scene,
                               {*thermal_in, *tear_in, *thermal_handles_in, *setting_in, *topology_out, *open_out,
                                *patch_out, *event_out, *thermal_manifest_out},
                               &thermal_checkpoint, kStart - 3);
  auto handle_out = handles.MakeOutput();
  auto setting_out = generator.MakeOutput();
  setting_out->Write({{1, kStart - 1, kStart - 1}, story.power_W, story.power_W, story.power_W});

  const auto seconds_of = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns - kStart); };
  const auto milliseconds = static_cast<std::int64_t>(1e3 * story.seconds);
  const auto at = [](double time_s) { return static_cast<std::int64_t>(1e3 * time_s); };
  std::uint64_t physics_index = 0, thermal_index = 0, haptics_index = 0, handle_sequence = 0;
  for (std::int64_t ms = 0; ms < milliseconds; ++ms) {
    // Each tick is woken with a different small delay.
    const std::int64_t now = kStart + ms * kMillisecond + (ms * 7919) % 30011;
    const double time = seconds_of(now);
    if (ms == at(story.kill_physics_s)) {
      physics.reset();
      if (story.kill_before_seal) Unseal(&physics_checkpoint);
    }
    if (ms == at(story.kill_physics_s) + 30) {
      physics = start_physics(now);
      physics_index = 0;
    }
    if (ms == at(story.kill_haptics_s)) {
      haptics.reset();
      haptics = start_haptics(now);
      haptics_index = 0;
    }
    if (ms % 2 == 0) {
      HandleState state;
      state.stamp = {++handle_sequence, kStart - 2, now};
      for (std::uint32_t i = 0; i < kMaxTools; ++i) {
        const ScriptPoint point = EvaluateScript(scene.script, i, time);
        state.handles[i] = {point.present, point.jaw_rad, 0, 1, 500};
        state.pedals = static_cast<std::uint8_t>(state.pedals | point.pedals);
      }
      handle_out->Write(state);
    }
    haptics->node->BusStep();
    haptics->node->ServoStep({haptics_index++, time, 1e-3, now});
    haptics->node->BusStep();
    const bool late = ms == at(story.late_physics_s);
    if (physics && ms % 10 == 0) {
      if (late) {
        ++physics_index;
      } else {
        // Runs shortly after the servo.
        const std::int64_t then = now + kMillisecond / 5;
        physics->node->Step({physics_index++, seconds_of(then), 1e-2, then});
      }
    }
    if (ms % 10 == 3) thermal.Step({thermal_index++, time, 1e-2, now});

    sessions.Record(now);
    // Manifests may arrive before the samples that they refer to.
    manifests.Record(now, story.manifest_change);
    tools.Record(now, story.tool_change);
    handles.Record(now);
    generator.Record(now);
    frames.Record(now, [&](TissueFrame*) { return story.record_frames; });
    models.Record(now);
    cautery.Record(now);
    topology.Record(now);
    open_cells.Record(now);
    tears.Record(now);
    clips.Record(now);
    patches.Record(now);
    events.Record(now);
  }
  writer.Close();
  return thermal.solver().cut_length_m();
}

}  // namespace fulcrum::replay::testing
