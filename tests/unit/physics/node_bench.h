// A physics node on in-process ports, with the writers of its inputs.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "physics_node/node/physics_node.h"
#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "services/transport/bus/in_process.h"

namespace fulcrum::physics {

inline constexpr std::int64_t kPeriod = 10'000'000;

struct Bus {
  bus::InProcessTopic<ToolState> tools;
  bus::InProcessTopic<HandleState> handles;
  bus::InProcessTopic<TopologyState> topology;
  bus::InProcessTopic<OpenCells> open_cells;
  bus::InProcessTopic<TissueFrame> frames;
  bus::InProcessTopic<ContactModel> contacts;
  bus::InProcessTopic<CauteryContact> cautery;
  bus::InProcessTopic<TearState> tears;
  bus::InProcessTopic<TickManifest> manifests;
  bus::InProcessTopic<ClipState> clips;
};

/// A node with its ports, and the writers of its inputs.
class Bench {
 public:
  Bench(const SceneView& scene, runtime::CheckpointFile* checkpoint, std::int64_t epoch = 1)
      : scene_(scene),
        tool_in_(bus_.tools.MakeInput()),
        handle_in_(bus_.handles.MakeInput()),
        topology_in_(bus_.topology.MakeInput()),
        open_in_(bus_.open_cells.MakeInput()),
        frame_out_(bus_.frames.MakeOutput()),
        contact_out_(bus_.contacts.MakeOutput()),
        cautery_out_(bus_.cautery.MakeOutput()),
        tear_out_(bus_.tears.MakeOutput()),
        manifest_out_(bus_.manifests.MakeOutput()),
        clip_out_(bus_.clips.MakeOutput()),
        tool_out_(bus_.tools.MakeOutput()),
        handle_out_(bus_.handles.MakeOutput()),
        topology_out_(bus_.topology.MakeOutput()),
        open_out_(bus_.open_cells.MakeOutput()),
        node_(scene,
              {*tool_in_, *handle_in_, *topology_in_, *open_in_, *frame_out_, *contact_out_, *cautery_out_, *tear_out_,
               *manifest_out_, *clip_out_},
              checkpoint, epoch) {}

  void Send(double time_s) {
    ToolState tools;
    HandleState handles;
    tools.stamp = handles.stamp = {++sequence_, 1, 1 + static_cast<std::int64_t>(time_s * 1e9)};
    const auto scripted = ScriptedTools(scene_, time_s);
    for (std::uint32_t i = 0; i < kMaxTools; ++i) {
      tools.tools[i].kind = scene_.tools[i].kind;
      tools.tools[i].p_WT = scripted[i].pose.p_WT;
      tools.tools[i].q_WT = scripted[i].pose.q_WT;
      handles.handles[i] = {true, scripted[i].pose.jaw_rad, 0, 1, 500};
      handles.pedals = static_cast<std::uint8_t>(handles.pedals | EvaluateScript(scene_.script, i, time_s).pedals);
    }
    tool_out_->Write(tools);
    handle_out_->Write(handles);
  }
  /// Sends the pose of a tool at a session time.
  void SendTool(std::uint32_t tool, const Vec3f& p_WT, std::int64_t stamp_ns, std::uint64_t epoch = 1,
                const Quatf& q_WT = Quatf::Identity()) {
    ToolState tools;
    tools.stamp = {++sequence_, epoch, stamp_ns};
    tools.tools[tool].kind = scene_.tools[tool].kind;
    tools.tools[tool].p_WT = p_WT;
    tools.tools[tool].q_WT = q_WT;
    tool_out_->Write(tools);
  }
  void SendHandle(std::int64_t stamp_ns) {
    HandleState handles;
    handles.stamp = {++sequence_, 1, stamp_ns};
    handle_out_->Write(handles);
  }
  /// Step `index`, with a delay of `late_ns`.
  void StepAt(std::uint64_t index, std::int64_t late_ns) {
    const std::int64_t ns = static_cast<std::int64_t>(index) * kPeriod + late_ns;
    node_.Step({index, 1e-9 * static_cast<double>(ns), 0.01, 1 + ns});
  }
  [[nodiscard]] Vec3f ToolPlace(std::uint32_t tool) const { return node_.simulation().Save().pose[tool].p_WT; }
  void Step() {
    const auto index = static_cast<std::int64_t>(tick_.index);
    tick_.stamp_ns = 1 + index * kPeriod;
    tick_.session_time_s = 0.01 * static_cast<double>(index);
    node_.Step(tick_);
    ++tick_.index;
  }
  void Play(double from_s, double to_s) {
    for (int i = static_cast<int>(from_s * 100 + 0.5); i < static_cast<int>(to_s * 100 + 0.5); ++i) {
      Send(0.01 * i);
      Step();
    }
  }
  [[nodiscard]] double Figure(const std::string& name) const {
    Health health;
    node_.FillHealth(&health);
    for (const Metric& metric : health.metrics) {
      if (metric.name == name) {
        return metric.value;
      }
    }
    return -1;
  }

  Bus bus_;
  SceneView scene_;
  std::unique_ptr<bus::Input<ToolState>> tool_in_;
  std::unique_ptr<bus::Input<HandleState>> handle_in_;
  std::unique_ptr<bus::Input<TopologyState>> topology_in_;
  std::unique_ptr<bus::Input<OpenCells>> open_in_;
  std::unique_ptr<bus::LoanOutput<TissueFrame>> frame_out_;
  std::unique_ptr<bus::Output<ContactModel>> contact_out_;
  std::unique_ptr<bus::Output<CauteryContact>> cautery_out_;
  std::unique_ptr<bus::Output<TearState>> tear_out_;
  std::unique_ptr<bus::Output<TickManifest>> manifest_out_;
  std::unique_ptr<bus::Output<ClipState>> clip_out_;
  std::unique_ptr<bus::Output<ToolState>> tool_out_;
  std::unique_ptr<bus::Output<HandleState>> handle_out_;
  std::unique_ptr<bus::Output<TopologyState>> topology_out_;
  std::unique_ptr<bus::Output<OpenCells>> open_out_;
  PhysicsNode node_;
  Tick tick_{0, 0.0, 0.01, 1};
  std::uint64_t sequence_ = 0;
};

class PhysicsNodeTest : public testing::Test {
 protected:
  scene::SceneData data_ = scene::BuildProcedural(scene::Small());
  SceneView scene_ = [this] {
    SceneView view = data_.View();
    view.hash = 77;
    return view;
  }();
};

}  // namespace fulcrum::physics
