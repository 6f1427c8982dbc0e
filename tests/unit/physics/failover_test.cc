// A pair of physics nodes on in-process ports: what a node that was replaced still has to know when it leads again.
#include "physics_node/node/failover.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "physics_node/node/physics_checkpoint.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/physics/node_bench.h"

namespace fulcrum::physics {
namespace {

/// One process of the pair: its ports, its checkpoint, its Failover.
class Process {
 public:
  Process(Bus* bus, const SceneView& scene, const std::filesystem::path& own, const std::filesystem::path& other,
          bool follows, std::int64_t epoch_ns)
      : tools_(bus->tools.MakeInput()),
        handles_(bus->handles.MakeInput()),
        topology_(bus->topology.MakeInput()),
        open_cells_(bus->open_cells.MakeInput()),
        others_(bus->manifests.MakeInput(64)),
        frames_(bus->frames.MakeOutput()),
        contacts_(bus->contacts.MakeOutput()),
        cautery_(bus->cautery.MakeOutput()),
        tears_(bus->tears.MakeOutput()),
        manifests_(bus->manifests.MakeOutput()),
        clips_(bus->clips.MakeOutput()),
        checkpoint_(own, scene.hash, kCheckpointLayout,
                    CheckpointCapacity(static_cast<Index>(scene.rest_position.size()))),
        failover_(
            scene,
            [&, epoch_ns](bool is_follower, std::optional<PhysicsNode>* node) {
              node->emplace(scene,
                            PhysicsNode::Ports{*tools_, *handles_, *topology_, *open_cells_, *frames_, *contacts_,
                                               *cautery_, *tears_, *manifests_, *clips_},
                            &checkpoint_, epoch_ns, 1, is_follower);
              node_ = node;
            },
            *others_, other, follows, epoch_ns) {}

  void Step(const Tick& tick) { failover_.Step(tick); }
  [[nodiscard]] bool leads() {
    Health health;
    health.state = HealthState::kRunning;  // as its process says
    failover_.FillHealth(&health);
    return health.state == HealthState::kRunning;
  }
  [[nodiscard]] const TissueSimulation& simulation() const { return (*node_)->simulation(); }

 private:
  std::unique_ptr<bus::Input<ToolState>> tools_;
  std::unique_ptr<bus::Input<HandleState>> handles_;
  std::unique_ptr<bus::Input<TopologyState>> topology_;
  std::unique_ptr<bus::Input<OpenCells>> open_cells_;
  std::unique_ptr<bus::Input<TickManifest>> others_;
  std::unique_ptr<bus::LoanOutput<TissueFrame>> frames_;
  std::unique_ptr<bus::Output<ContactModel>> contacts_;
  std::unique_ptr<bus::Output<CauteryContact>> cautery_;
  std::unique_ptr<bus::Output<TearState>> tears_;
  std::unique_ptr<bus::Output<TickManifest>> manifests_;
  std::unique_ptr<bus::Output<ClipState>> clips_;
  runtime::CheckpointFile checkpoint_;
  std::optional<PhysicsNode>* node_ = nullptr;
  Failover failover_;
};

TEST_F(PhysicsNodeTest, ALeaderThatWasReplacedKnowsTheCutWhenItLeadsAgain) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("fulcrum_failover_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::filesystem::path a_file = folder / "a", b_file = folder / "b";
  {
    Bus bus;
    Process a(&bus, scene_, a_file, b_file, false, 1);
    auto b = std::make_unique<Process>(&bus, scene_, b_file, a_file, true, 2);
    auto topology_out = bus.topology.MakeOutput();
    auto open_out = bus.open_cells.MakeOutput();
    std::uint64_t index = 0;
    const auto run = [&](int ticks, bool with_a, bool with_b) {
      for (int i = 0; i < ticks; ++i, ++index) {
        const Tick tick{index, 0.01 * static_cast<double>(index), 0.01,
                        1000 + static_cast<std::int64_t>(index) * kPeriod};
        if (with_a) a.Step(tick);
        if (with_b) b->Step(tick);
      }
    };
    run(5, true, true);
    TopologyState cut = WholeTopology(scene_);
    cut.stamp = {1, 1, 1};
    cut.revision = 3;
    const Index edge = 3 * (scene_.membrane.rows / 2 * scene_.membrane.cols + scene_.membrane.cols / 2);
    SetBit(cut.dead_edges, edge);
    topology_out->Write(cut);
    OpenCells cells;
    cells.stamp = {1, 1, 1};
    cells.scene_hash = scene_.hash;
    open_out->Write(cells);
    run(5, true, true);
    ASSERT_TRUE(a.leads());
    ASSERT_EQ(a.simulation().model().revision(), 3u);

    run(50, false, true);  // The first process is suspended.
    ASSERT_TRUE(b->leads());
    EXPECT_EQ(b->simulation().model().revision(), 3u);
    run(30, true, true);
    ASSERT_FALSE(a.leads());
    b.reset();
    run(30, true, false);
    ASSERT_TRUE(a.leads());
    EXPECT_EQ(a.simulation().model().revision(), 3u);
    EXPECT_FALSE(a.simulation().model().EdgeAlive(edge / 3, 0));
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace fulcrum::physics
