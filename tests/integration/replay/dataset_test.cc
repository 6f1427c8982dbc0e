// The frames of a data set: intrinsics of a zoomed scope, recordings that begin late, options that do not belong to it.
#include <gtest/gtest.h>

#include <boost/property_tree/json_parser.hpp>
#include <boost/property_tree/ptree.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "services/base/core/scope.h"
#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/topics.h"
#include "tests/integration/replay/short_session.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum::replay {
namespace {

using Json = boost::property_tree::ptree;

constexpr double kFramesPatience_s = 100;  // A software rasteriser on a busy machine.

void SmallField(scene::SceneData* data) {
  testing::ShortSession::Hurry(data);
  data->fixed.render.width = 320;
  data->fixed.render.height = 180;
}

std::string ReplayerSaid(const std::vector<std::string>& arguments, int wanted_code) {
  fulcrum::testing::Program run("replayer", arguments);
  std::optional<int> code;
  fulcrum::testing::WaitFor(kFramesPatience_s, [&] { return (code = run.Poll()).has_value(); });
  EXPECT_EQ(code, wanted_code) << run.Said();
  return run.Said();
}

Json ParsedJson(const std::string& text) {
  std::istringstream in(text);
  Json json;
  boost::property_tree::read_json(in, json);
  return json;
}

std::vector<Json> FramesIn(const std::filesystem::path& set) {
  std::istringstream in(fulcrum::testing::ReadFile(set / "frames.jsonl"));
  std::vector<Json> frames;
  for (std::string line; std::getline(in, line);) frames.push_back(ParsedJson(line));
  return frames;
}

std::vector<double> NumbersIn(const Json& list) {
  std::vector<double> numbers;
  for (const auto& [unused, number] : list) numbers.push_back(number.get_value<double>());
  return numbers;
}

/// Pixel of a point by the matrix and the intrinsics of a frame.
Vec2d ProjectedBy(const Json& frame, const std::vector<double>& p_W) {
  Vec3d p_C;
  int row = 0;
  for (const auto& [unused, each] : frame.get_child("world_to_camera")) {
    const std::vector<double> m = NumbersIn(each);
    if (row < 3) p_C[row] = m[0] * p_W[0] + m[1] * p_W[1] + m[2] * p_W[2] + m[3];
    ++row;
  }
  return {frame.get<double>("fx") * p_C.x() / p_C.z() + frame.get<double>("cx"),
          frame.get<double>("fy") * p_C.y() / p_C.z() + frame.get<double>("cy")};
}

TEST(DatasetFrames, HaveTheIntrinsicsOfTheirZoom) {
  constexpr std::size_t kScope = 2;
  const auto with_scope = [](scene::SceneData* data) {
    SmallField(data);
    ToolDescription& scope = data->fixed.tools[kScope];
    scope = data->fixed.tools[0];
    scope.kind = ToolKind::kScope;
    const Vec3f tip_W = data->fixed.render.scope_tip_W;
    data->script.push_back({.time_s = 0.2f, .tool = kScope, .p_W = tip_W, .jaw_rad = 0, .pedals = 0, .power_W = 0});
    data->script.push_back(
        {.time_s = 0.8f, .tool = kScope, .p_W = tip_W, .jaw_rad = kZoomRing_rad, .pedals = 0, .power_W = 0});
  };
  const RenderParams render = scene::BuildProcedural(scene::Small()).View().render;
  const auto hold = [&](ToolState* sample) {
    const Vec3f shaft = ShaftOf(render), right = shaft.cross(LevelUp(render)).normalized();
    Mat3f turn;
    turn << right, shaft.cross(right), shaft;
    sample->tools[kScope].kind = ToolKind::kScope;
    sample->tools[kScope].p_WT = render.scope_tip_W;
    sample->tools[kScope].q_WT = Quatf(turn);
    return true;
  };
  const testing::ShortSession session("dataset_zoom", {.seconds = 1.1, .tool_change = hold}, with_scope);
  const std::filesystem::path set = session.folder() / "set";
  ReplayerSaid({session.recording(), "--dataset", set, "--every", "0.5", "--baseline", "0"}, 0);
  const std::vector<Json> frames = FramesIn(set);
  ASSERT_EQ(frames.size(), 3u);
  int compared = 0;
  for (const Json& frame : frames) {
    for (const auto& [unused, tool] : frame.get_child("tools")) {
      for (const auto& [none, keypoint] : tool.get_child("keypoints")) {
        const std::vector<double> pixel = NumbersIn(keypoint.get_child("pixel"));
        if (pixel.size() != 2) continue;  // Behind the camera.
        const Vec2d projected = ProjectedBy(frame, NumbersIn(keypoint.get_child("world_m")));
        EXPECT_NEAR((projected - Vec2d(pixel[0], pixel[1])).norm(), 0, 0.02) << keypoint.get<std::string>("name");
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 10);
  const double first = frames[0].get<double>("fx");
  EXPECT_NEAR(frames[2].get<double>("fx") / first, kLargestZoom, 0.03) << "jaws follow in steps";
  EXPECT_NEAR(ParsedJson(fulcrum::testing::ReadFile(set / "calibration.json")).get<double>("fx"), first, 1e-6);
}

/// Copies a recording without what was recorded before a session time, apart from the session's own data, which a
/// recorder that starts late gets as well.
void CopyFrom(const std::filesystem::path& recording, double from_s, const std::filesystem::path& late) {
  recording::McapReader reader(recording);
  recording::McapWriter writer(late, "", "test");
  std::map<std::uint16_t, std::uint16_t> channels;
  const auto from_ns = static_cast<std::uint64_t>(testing::kCartStart_ns) + static_cast<std::uint64_t>(1e9 * from_s);
  for (recording::McapMessage message{}; reader.Next(&message);) {
    const recording::McapChannel& channel = reader.channels().at(message.channel);
    if (message.log_time_ns < from_ns && channel.topic != bus::RoleOf<SceneManifest>().name) continue;
    const auto [number, is_new] = channels.try_emplace(message.channel);
    if (is_new) {
      number->second = writer.AddChannel(0, channel.topic, "cdr", {{"as", std::to_string(message.channel)}});
    }
    writer.Write(number->second, message.sequence, message.log_time_ns, message.publish_time_ns,
                 std::as_bytes(message.data));
  }
  writer.Close();
}

TEST(DatasetFrames, BeginWithTheFirstTissueOfARecordingThatBeginsLate) {
  const testing::ShortSession session("dataset_late", {.seconds = 1.7}, SmallField);
  const std::filesystem::path late = session.folder() / "recording-2.mcap", set = session.folder() / "set";
  CopyFrom(session.recording(), 0.9, late);
  ReplayerSaid({late, "--dataset", set, "--every", "0.2", "--baseline", "0"}, 0);
  const std::vector<Json> frames = FramesIn(set);
  ASSERT_EQ(frames.size(), 4u) << "1, 1.2, 1.4 and 1.6 s";
  std::set<std::string> depths;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_NEAR(frames[i].get<double>("time_s"), 1 + 0.2 * static_cast<double>(i), 1e-9);
    depths.insert(fulcrum::testing::ReadFile(set / ("depth/00000" + std::to_string(i) + ".png")));
  }
  EXPECT_EQ(depths.size(), frames.size()) << "the instruments move";
  const std::string said = ReplayerSaid({late, "--dataset", session.folder() / "none", "--until", "0.5"}, 2);
  EXPECT_NE(said.find("shows session times 0.9"), std::string::npos) << said;
}

TEST(ReplayOptions, ThatWouldBeIgnoredAreRefused) {
  const testing::ShortSession session("options_test", {.seconds = 0.2}, SmallField);
  const std::string folder = session.folder() / "new";
  const std::map<std::string, std::vector<std::string>> kinds{
      {"into", {"physics"}}, {"live", {}},          {"film", {}},         {"video", {folder + ".mp4"}},
      {"dataset", {folder}}, {"lerobot", {folder}}, {"test", {"physics"}}};
  struct Option {
    std::string name;
    std::vector<std::string> value;
    std::set<std::string> kinds;  ///< That read it.
  };
  const std::vector<Option> options{{"set", {"physics.grip_force_N=4"}, {"into"}},
                                    {"console", {}, {"into"}},
                                    {"assert", {"ticks > 1"}, {"test"}},
                                    {"junit", {folder + ".xml"}, {"test"}},
                                    {"every", {"1"}, {"dataset"}},
                                    {"within", {"5"}, {"video"}},
                                    {"only", {"physics"}, {"live"}},
                                    {"until", {"1"}, {"into", "test", "video", "dataset", "lerobot"}},
                                    {"threads", {"1"}, {"into", "test"}}};
  for (const auto& [kind, value] : kinds) {
    for (const Option& option : options) {
      if (option.kinds.contains(kind)) continue;
      std::vector<std::string> arguments{session.recording(), "--" + kind};
      arguments.insert(arguments.end(), value.begin(), value.end());
      arguments.push_back("--" + option.name);
      arguments.insert(arguments.end(), option.value.begin(), option.value.end());
      const std::string said = ReplayerSaid(arguments, 2),
                        wanted = "--" + option.name + " cannot be combined with --" + kind;
      EXPECT_NE(said.find(wanted), std::string::npos) << wanted << "\n" << said;
    }
  }
  const std::string said = ReplayerSaid({session.recording(), "--into", "physics", "--console", "--until", "1"}, 2);
  EXPECT_NE(said.find("--until; give the time to its command: go S"), std::string::npos) << said;
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace fulcrum::replay
