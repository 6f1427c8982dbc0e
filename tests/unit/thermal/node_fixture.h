// A ThermalNode on in-process ports, over a flat membrane.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/numerics/thermal/flat_scene.h"
#include "tests/unit/thermal/node_bus.h"

namespace fulcrum::thermal {

/// Sends contacts, pedals and settings to a node and steps it in frames of 10 ms.
class ThermalNodeTest : public ::testing::Test {
 protected:
  ThermalNodeTest() : data_(FlatScene(31, 41, 1e-3f)), scene_(data_.View()) {
    folder_ =
        std::filesystem::temp_directory_path() / ("fulcrum_thermal_node_" + std::to_string(::getpid()) + "_" +
                                                  ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  ~ThermalNodeTest() override { std::filesystem::remove_all(folder_); }

  void OpenCheckpoint() {
    checkpoint_.reset();  // the file is locked by its owner
    checkpoint_ = std::make_unique<runtime::CheckpointFile>(folder_ / "thermal_node.checkpoint", scene_.hash,
                                                            kCheckpointLayout, ThermalNode::CheckpointCapacity(scene_));
  }
  std::unique_ptr<ThermalNode> MakeNode() {
    return std::make_unique<ThermalNode>(scene_, bus_.ports(), checkpoint_.get(), ++epoch_);
  }

  /// Sends a contact of the energised tip at (s, 10.2 mm) for a session time.
  void Send(float s, double time_s) {
    if (demands_) bus_.Demand(CauteryMode::kCut, 35, std::max(std::llround(1e9 * time_s) - 1000, 0LL));
    CauteryContact contact = TouchAt({s, 0.0102f}, 5e-4f);
    contact.session_time_s = time_s;
    contact.stamp = {++sequence_, 1, tick_.stamp_ns};
    ASSERT_TRUE(bus_.contact_out->Write(contact));
  }
  /// One tick with the tip at s.
  void Touch(ThermalNode* node, float s) {
    Send(s, tick_.session_time_s);
    Step(node);
  }
  /// One tick with the tip off the tissue.
  void Lift(ThermalNode* node) {
    CauteryContact contact;
    contact.session_time_s = tick_.session_time_s;
    contact.stamp = {++sequence_, 1, tick_.stamp_ns};
    ASSERT_TRUE(bus_.contact_out->Write(contact));
    Step(node);
  }
  /// A figure of Health; NaN: there is none of this name.
  [[nodiscard]] static double MetricOf(const ThermalNode& node, const std::string& name) {
    Health health;
    node.FillHealth(&health);
    EXPECT_LE(health.metrics.size() + 2, bus::kMaxMetrics) << "the app adds locks_inherited and foreign_samples";
    for (const Metric& metric : health.metrics) {
      if (metric.name == name) return metric.value;
    }
    return std::nan("");
  }
  [[nodiscard]] TickManifest NewestManifest() {
    TickManifest manifest;
    EXPECT_TRUE(bus_.manifest_in->TakeLatest(&manifest));
    return manifest;
  }
  /// Sequences of the samples of a topic that the newest tick consumed.
  [[nodiscard]] std::vector<std::uint64_t> NewestConsumed(TopicId topic) {
    std::vector<std::uint64_t> sequences;
    for (const ConsumedInput& input : NewestManifest().consumed) {
      if (input.topic == topic) sequences.push_back(input.sequence);
    }
    return sequences;
  }
  void Step(ThermalNode* node) {
    Advance(&tick_);
    node->Step(tick_);
  }
  /// Cuts from s0 to s1 at 8 mm/s.
  void Cut(ThermalNode* node, float s0, float s1) {
    for (float s = s0; s < s1; s += 8e-5f) Touch(node, s);
  }
  std::optional<TopologyState> NewestTopology() {
    TopologyState state;
    return bus_.topology_in->TakeLatest(&state) ? std::optional(state) : std::nullopt;
  }

  scene::SceneData data_;
  SceneView scene_;
  std::filesystem::path folder_;
  NodeBus bus_;
  std::unique_ptr<runtime::CheckpointFile> checkpoint_;
  Tick tick_;
  bool demands_ = true;  ///< Send a pressed pedal with each contact.
  std::uint64_t sequence_ = 0;
  std::int64_t epoch_ = 100;
};

}  // namespace fulcrum::thermal
