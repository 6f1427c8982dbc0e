// Random grasps, cuts and releases, one after the other, with FaultOf after each: the tissue of mode accurate under
// random operations. The same seed gives the same sequence.
#pragma once

#include <array>
#include <memory>
#include <random>
#include <string>

#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::physics {

struct FuzzCounts {
  int grasps = 0, holds = 0, pulls = 0, releases = 0, cuts = 0, debris = 0, restarts = 0, revivals = 0, rests = 0;
  int restless = 0;  ///< Rests after which some tissue still moved.
  std::uint64_t steps = 0;
  float farthest_m = 0, fastest_m_s = 0, farthest_at_rest_m = 0, fastest_at_rest_m_s = 0;
};

class GraspCutFuzz {
 public:
  /// An even seed has a grasper and a hook, an odd seed two graspers.
  explicit GraspCutFuzz(unsigned seed, bool several_solids = false);

  /// Runs the next operation and its steps; returns a violated invariant, or nothing.
  [[nodiscard]] std::string Operate();
  /// Releases all grasps, removes the tools and steps until the tissue sleeps, or for 15 s; then returns a violated
  /// invariant, by stricter bounds.
  [[nodiscard]] std::string Rest();

  [[nodiscard]] const FuzzCounts& counts() const { return counts_; }
  [[nodiscard]] std::uint64_t StateHash() const { return simulation_->StateHash(); }

 private:
  static constexpr Index kOperated = 2;  ///< Tools.

  [[nodiscard]] float Unit() { return unit_(random_); }
  [[nodiscard]] Index Below(Index count) { return static_cast<Index>(random_() % count); }
  [[nodiscard]] Vec3f PlaceOnTissue();
  void Step();
  void Drive(std::size_t tool, const Vec3f& tip, float jaw_rad, int steps);
  void DoGrasp(std::size_t tool);
  void DoPull(std::size_t tool);
  void DoRelease(std::size_t tool);
  void DoCut();
  void DoSlit();
  void DoRestart();
  void Publish();

  std::mt19937 random_;
  std::uniform_real_distribution<float> unit_{0.0f, 1.0f};
  bool several_solids_;
  scene::SceneData data_;
  SceneView scene_;
  std::unique_ptr<TissueSimulation> simulation_;
  std::array<ToolInput, kMaxTools> tools_;
  TopologyState topology_;
  StepReport report_;
  int cuts_since_whole_ = 0;
  FuzzCounts counts_;
};

}  // namespace fulcrum::physics
