// The generator's power is changed while the cart cuts: effect of the operator's command in Health, in the recording
// and in its replay.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/cart.h"
#include "tests/support/cart_watch.h"
#include "tests/support/program.h"
#include "tests/support/replay_run.h"
#include "tests/support/working_scene.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::CartState;

constexpr int kDomain = 58;
constexpr double kPatience_s = 30;

struct Said {
  int exit_code = -1;
  std::string text;
};

Said Generator(std::vector<std::string> words) {
  words.insert(words.begin(), "generator");
  words.insert(words.end(), {"--domain", std::to_string(kDomain)});
  testing::Program program("fulcrum", words);
  std::optional<int> code;
  (void)testing::WaitFor(kPatience_s, [&] { return (code = program.Poll()).has_value(); });
  return {code.value_or(-1), program.Said()};
}

bool Sets(const CartState& state, double power_W) { return state.Metric(NodeId::kThermal, "set_power_W") == power_W; }

TEST(GeneratorOfTheCart, IsTurnedDuringACutAndTheReplayComesToTheSameStates) {
  const fs::path folder = fs::temp_directory_path() / ("generator." + std::to_string(::getpid()));
  fs::create_directories(folder);
  const fs::path scene = folder / "working.yaml";
  std::ofstream(scene) << testing::WorkingScene("small", 40);
  {
    testing::Cart cart(scene, kDomain, {"--record"});
    testing::CartWatch watch(kDomain, scene, cart.session());
    // The power of the script.
    ASSERT_TRUE(watch.WaitUntil(60, [](const CartState& state) { return Sets(state, 35); })) << cart.Said();

    const Said turned = Generator({"--cut", "50", "--coag", "25"});
    EXPECT_EQ(turned.exit_code, 0) << turned.text;
    EXPECT_NE(turned.text.find("cut 50 W, coag 25 W"), std::string::npos) << turned.text;
    EXPECT_TRUE(watch.WaitUntil(kPatience_s, [](const CartState& state) { return Sets(state, 50); }))
        << "the command takes effect during the first line";
    EXPECT_TRUE(watch.WaitUntil(kPatience_s, [](const CartState& state) {
      return state.Metric(NodeId::kSupervisor, "generator_coag_W") == 25;
    }));

    const Said wrong = Generator({"--cut", "500"});
    EXPECT_NE(wrong.exit_code, 0);
    EXPECT_NE(wrong.text.find("0 to 300 W"), std::string::npos) << wrong.text;
    const Said shown = Generator({});
    EXPECT_EQ(shown.exit_code, 0);
    EXPECT_NE(shown.text.find("cut 50 W, coag 25 W"), std::string::npos) << shown.text;

    // A restarted node receives the setting again.
    const auto nodes = cart.nodes();
    ASSERT_TRUE(nodes.contains("thermal_node")) << cart.Said();
    const auto epoch = watch.See(
        [](const CartState& state) { return state.voices[static_cast<std::size_t>(NodeId::kThermal)].epoch; });
    ::kill(nodes.at("thermal_node"), SIGKILL);
    EXPECT_TRUE(watch.WaitUntil(kPatience_s, [&](const CartState& state) {
      return state.voices[static_cast<std::size_t>(NodeId::kThermal)].epoch > epoch && Sets(state, 50);
    })) << cart.Said();
    std::this_thread::sleep_for(std::chrono::seconds(1));
    cart.Signal(SIGINT);
    ASSERT_EQ(cart.FaultAtEnd(kPatience_s), "");

    const fs::path recording = cart.session() / "recording.mcap";
    const auto run = testing::Replay(recording, {"--into", "physics", "thermal"}, 60);
    if (run.said.find("the last of its process") == std::string::npos) {
      EXPECT_EQ(run.exit_code, 0) << run.said;
      EXPECT_GT(run.figures.at("thermal_node.compared"), 200) << run.said;
    }
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace fulcrum
