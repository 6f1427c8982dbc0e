// One hash per scene: the states of physics, thermal and haptics after a part of the scene's own script, over ports as
// on the cart. They are equal for each number of threads, on a CPU with AVX-512 and on one without it, AVX2 and FMA
// (tested under an emulator: baseline kernels, the C library's other mathematics), so one committed number stands for
// all of them. It is that of gcc's release build.
//
// An intended change of the numerics changes the hashes: the failed test then prints the row to be written here. An
// unintended change is detected.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>

#include "physics_node/implicit/kernels.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "tests/unit/replay/recorded_cart.h"

namespace fulcrum::replay {
namespace {

using Hashes = std::map<std::string, std::uint64_t>;

struct Expected {
  const char* scene;
  double seconds;  ///< Session time of the script at which the hook has cut for a while.
  std::uint64_t physics, thermal, haptics;
};

constexpr Expected kSmall{"small", 3.2, 0x09d87e301c1d96fe, 0xb477576aa251076d, 0x883794453df66b99};
constexpr Expected kBuiltIn{"built-in", 9.0, 0x4fb7b93fdb9f2fc1, 0x3489c1eb15a8f954, 0x448ded674323b9a7};

// The states of clang's and the sanitizers' builds have not been compared, and under sanitizers this takes minutes.
#if defined(__clang__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kOtherBuild = true;
#else
constexpr bool kOtherBuild = false;
#endif

std::string Row(const Expected& scene, const Hashes& hashes) {
  std::array<char, 200> row{};
  const auto at = [&](const char* name) { return static_cast<unsigned long long>(hashes.at(name)); };
  std::snprintf(row.data(), row.size(), "{\"%s\", %.1f, 0x%016llx, 0x%016llx, 0x%016llx}", scene.scene, scene.seconds,
                at("physics_node"), at("thermal_node"), at("haptics_node"));
  return row.data();
}

class StateHash : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kOtherBuild) GTEST_SKIP() << "the committed states are those of a build by gcc";
  }
  StateHash() : folder_(std::filesystem::temp_directory_path() / ("fulcrum_state_hash_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~StateHash() override { std::filesystem::remove_all(folder_); }

  /// Hashes of the last tick of each node.
  [[nodiscard]] Hashes Play(const SceneView& scene, double seconds, int threads) const {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    Hashes hashes;
    testing::CartStory story{.seconds = seconds, .threads = threads};
    story.record_frames = false;
    story.manifest_change = [&](const TickManifest* manifest) {
      hashes[NodeName(manifest->node)] = manifest->state_hash;
      return true;
    };
    cut_length_m_ = testing::RecordCart(scene, folder_, story);
    return hashes;
  }

  void Check(const Expected& expected, int threads) {
    const std::filesystem::path yaml =
        std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes" / (std::string(expected.scene) + ".yaml");
    const auto description = scene::ReadSceneYaml(yaml, {});
    scene::SceneData data = scene::BuildScene(description.settings, {});
    const Hashes hashes = Play(data.View(), expected.seconds, threads);
    EXPECT_GT(cut_length_m_, 2e-3f) << "nothing was cut: the hash proves little";
    const Hashes committed{
        {"physics_node", expected.physics}, {"thermal_node", expected.thermal}, {"haptics_node", expected.haptics}};
    EXPECT_EQ(hashes, committed) << threads << " threads, kernels " << physics::implicit::KernelsFor().name
                                 << "; if the change of the numerics is intended, its row is now:\n"
                                 << Row(expected, hashes);
  }

  const std::filesystem::path folder_;
  mutable float cut_length_m_ = 0;
};

TEST_F(StateHash, OfSmallIsTheCommittedOneOnOneThread) { Check(kSmall, 1); }

TEST_F(StateHash, OfSmallIsTheCommittedOneOnTwoThreads) { Check(kSmall, 2); }

TEST_F(StateHash, OfBuiltInIsTheCommittedOne) { Check(kBuiltIn, 2); }

}  // namespace
}  // namespace fulcrum::replay
