// The haptics_node executable with simulated devices and with the stand-in of the Touch's driver: its calibration
// command, its messages when something is missing, and a session with a device that moves.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "haptics_node/node/trocar_store.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/support/program.h"
#include "tests/unit/haptics/swing.h"

namespace fulcrum::haptics {
namespace {

namespace fs = std::filesystem;
using fulcrum::testing::Program;

constexpr int kDomain = 48;

class HapticsProcess : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("haptics_process_test." + std::to_string(::getpid()));
    fs::create_directories(folder);
  }
  void TearDown() override {
    node = Program();
    fs::remove_all(folder);
  }

  /// Starts haptics_node; the driver, if any, is the stand-in.
  void Start(const std::vector<std::string>& arguments, bool with_driver) {
    ::setenv("XDG_STATE_HOME", folder.c_str(), 1);
    ::setenv("LD_LIBRARY_PATH", with_driver ? FULCRUM_HD_FOLDER : "/nonexistent", 1);
    ::setenv("HD_STAND_IN_SWING", "1", 1);
    node = Program("haptics_node", arguments);
  }
  int Calibrate(bool with_driver = true) {
    Start({"calibrate-trocar", "--cart", Cart(), "--tool", "0", "--seconds", "2", "--save", folder / "saved.csv"},
          with_driver);
    return node.End(0);
  }
  [[nodiscard]] std::string Cart() const { return folder / "cart.yaml"; }
  void WriteCart(const std::string& device) const {
    std::ofstream(Cart()) << "name: bench\ndevices: {tool0: " << device << ", tool1: {kind: none}}\n";
  }
  [[nodiscard]] std::optional<StoredTrocar> Stored() const {
    return LoadTrocar(TrocarFile(folder / "fulcrum" / "trocars", "bench", 0));
  }

  fs::path folder;
  Program node;
};

TEST_F(HapticsProcess, CalibratesTheTrocarOfASimulatedDevice) {
  const Vec3d pivot(0.012, -0.095, -0.110);
  std::ofstream(folder / "motion.csv") << ToText(testing::Swing(pivot, 0.3, 0.001));
  WriteCart("{kind: simulated, motion: motion.csv}");
  EXPECT_EQ(Calibrate(), 0) << node.Said();
  EXPECT_NE(node.Said().find("residual 0.8"), std::string::npos) << node.Said();
  EXPECT_NE(node.Said().find("condition"), std::string::npos) << node.Said();
  ASSERT_TRUE(Stored().has_value());
  EXPECT_LT((Stored()->p_DP - pivot).norm(), 0.0005);
}

TEST_F(HapticsProcess, RefusesAMotionThatIsTooSmallAndStoresNothing) {
  std::ofstream(folder / "motion.csv") << ToText(testing::Swing(Vec3d(0, -0.1, -0.1), 0.05, 0.001));
  WriteCart("{kind: simulated, motion: motion.csv}");
  EXPECT_EQ(Calibrate(), 2);
  EXPECT_NE(node.Said().find("nothing stored: the motion was too small"), std::string::npos) << node.Said();
  EXPECT_FALSE(Stored().has_value());
}

TEST_F(HapticsProcess, CalibratesTheTrocarOfATouchAndSavesTheMotionForASimulatedOne) {
  WriteCart("{kind: touch, name: Left Device, serial: A100}");
  EXPECT_EQ(Calibrate(), 0) << node.Said();
  ASSERT_TRUE(Stored().has_value()) << node.Said();
  EXPECT_EQ(Stored()->serial, "A100");
  EXPECT_LT((Stored()->p_DP - Vec3d(0, -0.1, -0.1)).norm(), 1e-5);
  fs::rename(folder / "saved.csv", folder / "motion.csv");
  fs::remove_all(folder / "fulcrum");
  WriteCart("{kind: simulated, motion: motion.csv}");
  EXPECT_EQ(Calibrate(), 0) << node.Said();
  EXPECT_LT((Stored()->p_DP - Vec3d(0, -0.1, -0.1)).norm(), 1e-5);
}

TEST_F(HapticsProcess, MissingDriverEndsWithTheUsageCodeAndWhatToInstall) {
  WriteCart("{kind: touch}");
  EXPECT_EQ(Calibrate(false), 2);
  EXPECT_NE(node.Said().find("the Touch needs libHD.so, which cannot be loaded"), std::string::npos) << node.Said();
  EXPECT_NE(node.Said().find("Touch Device Driver"), std::string::npos) << node.Said();
}

TEST_F(HapticsProcess, ATouchMovesItsToolInASession) {
  WriteCart("{kind: touch, name: Left Device}");
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  scene::WriteSceneFile(data, "name: small\n", folder / "scene");
  const scene::SceneFile scene(folder / "scene");
  bus::DdsParticipant participant({.domain = kDomain, .node_name = "test", .shared_memory = {}});
  const auto manifests = participant.MakeOutput<SceneManifest>();
  const auto tools = participant.MakeInput<ToolState>();
  const auto healths = participant.MakeInput<Health>();
  Start({"--scene", folder / "scene", "--session", folder, "--domain", std::to_string(kDomain), "--cart", Cart()},
        true);
  const std::int64_t now = runtime::MonotonicNs();
  SceneManifest manifest;
  manifest.stamp = bus::Stamper(now).Next(now);
  manifest.scene_name = scene.view().name;
  manifest.session_id = "test";
  manifest.scene_hash = scene.view().hash;
  manifest.session_start_ns = now;
  manifests->Write(manifest);

  // The hand swings by 0.4 rad to each side; the tool follows once it has reached the hand.
  ToolState tool;
  Vec3f least = Vec3f::Constant(1), most = Vec3f::Constant(-1);
  for (int i = 0; i < 8000 && !((most - least).x() > 0.05f); ++i) {
    if (tools->TakeLatest(&tool) && tool.tools[0].kind != ToolKind::kNone) {
      least = least.cwiseMin(tool.tools[0].p_WT);
      most = most.cwiseMax(tool.tools[0].p_WT);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_GT((most - least).x(), 0.05f) << node.Said();
  EXPECT_EQ(tool.tools[1].kind, ToolKind::kNone);
  EXPECT_NE(node.Said().find("tool 0: Touch A100"), std::string::npos) << node.Said();
  EXPECT_EQ(node.End(SIGTERM), 0);
}

}  // namespace
}  // namespace fulcrum::haptics
