// A cart that runs the scene `clips`: two clips close a vessel, the hook divides it between them, and no blood flows.
// Without the clips it bleeds. The test waits for what happens, not for times, and reads blood from the recorded
// topics, which a slow picture does not change.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "services/scene/format/scene_file.h"
#include "tests/support/cart.h"
#include "tests/support/cart_watch.h"
#include "tests/support/recorded_clips.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::CartState;

constexpr int kDomain = 90;
constexpr double kPatience_s = 60;  // A session takes 18 s.

/// The script of the scene, with the applier aside all the time.
constexpr const char* kNoClips = R"(name: no_clips
base: clips
script:
  tool2:
    - {time_s: 0.0, sheet: [0.40, 0.40], height_mm: 30, offset_mm: [0, -45, 0], jaw_deg: 30, roll_deg: 90}
    - {time_s: 18.0, sheet: [0.48, 0.40], height_mm: 30, offset_mm: [0, -50, 0], jaw_deg: 30, roll_deg: 90}
)";

double Clips(const CartState& state) { return state.Metric(NodeId::kPhysics, "clips"); }
double Cut_mm(const CartState& state) { return state.Metric(NodeId::kThermal, "cut_length_mm"); }
double Blood_ul(const CartState& state) { return state.Metric(NodeId::kRender, "blood_ul"); }

/// A session until `clips` are on the tissue, the vessel is divided and the script has ended.
class ClippedSession {
 public:
  /// @param scene a name or a file. @param description its YAML.
  ClippedSession(const std::string& scene, const fs::path& description)
      : cart_(scene, kDomain, {"--record", "--set", "render.width=480", "--set", "render.height=270"}),
        watch_(kDomain, description, cart_.session()) {}
  void Run(double clips) {
    ASSERT_TRUE(watch_.WaitUntil(kPatience_s, [&](const CartState& state) { return Clips(state) == clips; }))
        << cart_.Said();
    ASSERT_TRUE(watch_.WaitUntil(kPatience_s, [](const CartState& state) { return Cut_mm(state) > 3; }))
        << cart_.Said();
    // Whether all nodes kept their rates is not asked here.
    ASSERT_TRUE(cart_.WaitForEnd(kPatience_s)) << cart_.Said();
    EXPECT_EQ(watch_.See(Clips), clips);
    const scene::SceneFile scene(fs::canonical(cart_.session() / "scene.fulcrum"));
    outcome_ = testing::FollowClips(scene.view(), cart_.session() / "recording.mcap");
    EXPECT_EQ(outcome_.clips, clips);
    EXPECT_GT(outcome_.cuts, 0u);
  }
  [[nodiscard]] double blood_m3() const { return outcome_.shed_m3; }
  /// By the picture's process itself; 0 also where it was too slow to look for blood.
  [[nodiscard]] double BloodOfThePicture_ul() { return watch_.See(Blood_ul); }

 private:
  testing::Cart cart_;
  testing::CartWatch watch_;
  testing::ClipOutcome outcome_;
};

TEST(ClipsOfACart, CloseAVesselThatIsDividedBetweenThem) {
  ClippedSession session("clips", fs::path(FULCRUM_SOURCE_DIR) / "deploy/scenes/clips.yaml");
  session.Run(2);
  EXPECT_EQ(session.blood_m3(), 0);
  EXPECT_EQ(session.BloodOfThePicture_ul(), 0);
}

TEST(ClipsOfACart, AreNeeded) {
  const fs::path folder = fs::temp_directory_path() / ("clips_test." + std::to_string(::getpid()));
  fs::create_directories(folder);
  const fs::path scene = folder / "no_clips.yaml";
  std::ofstream(scene) << kNoClips;
  {
    ClippedSession session(scene, scene);
    session.Run(0);
    EXPECT_GT(session.blood_m3(), 1e-9);
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace fulcrum
