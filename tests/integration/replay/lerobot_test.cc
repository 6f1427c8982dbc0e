// The replayer's set for robot learning, against the recordings that it was made of.
#include "services/apps/replayer/lerobot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/property_tree/json_parser.hpp>
#include <boost/property_tree/ptree.hpp>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "render_node/scene_graph/drawn_surfaces.h"
#include "services/apps/replayer/projector.h"
#include "services/records/recording/mcap_reader.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"
#include "tests/integration/replay/short_session.h"
#include "tests/support/cart.h"
#include "tests/support/parquet_reader.h"
#include "tests/support/program.h"

namespace fulcrum::replay {
namespace {

namespace fs = std::filesystem;
using Json = boost::property_tree::ptree;

void SmallPicture(scene::SceneData* data) {
  testing::ShortSession::Hurry(data);
  data->fixed.render.width = 320;
  data->fixed.render.height = 180;
}

std::string SaidBy(const std::string& program, const std::vector<std::string>& arguments, int wanted_code) {
  constexpr double kPatience_s = 100;  // A software rasteriser on a busy machine.
  fulcrum::testing::Program run(program, arguments);
  std::optional<int> code;
  fulcrum::testing::WaitFor(kPatience_s, [&] { return (code = run.Poll()).has_value(); });
  EXPECT_EQ(code, wanted_code) << program << ": " << run.Said();
  return run.Said();
}

Json JsonOf(const std::string& text) {
  std::istringstream in(text);
  Json json;
  boost::property_tree::read_json(in, json);
  return json;
}

std::vector<std::string> LinesOf(const fs::path& file) {
  std::istringstream in(fulcrum::testing::ReadFile(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Recorded place of a tool's tip at a session time, linear between two samples [m].
Vec3d TipAt(const std::vector<ToolState>& samples, std::size_t tool, double time_s) {
  const double stamp_ns = testing::kCartStart_ns + 1e9 * time_s;
  std::size_t next = 0;
  while (next + 1 < samples.size() && static_cast<double>(samples[next].stamp.stamp_ns) <= stamp_ns) ++next;
  const ToolState &a = samples[next > 0 ? next - 1 : 0], &b = samples[next];
  const double begin = static_cast<double>(a.stamp.stamp_ns), end = static_cast<double>(b.stamp.stamp_ns);
  const double share = end > begin ? std::clamp((stamp_ns - begin) / (end - begin), 0.0, 1.0) : 0;
  return (1 - share) * a.tools[tool].p_WT.cast<double>() + share * b.tools[tool].p_WT.cast<double>();
}

std::vector<ToolState> ToolStatesOf(const fs::path& recording) {
  recording::McapReader reader(recording);
  std::vector<ToolState> samples;
  ToolState sample;
  for (recording::McapMessage message{}; reader.Next(&message);) {
    if (reader.channels().at(message.channel).topic != bus::RoleOf<ToolState>().name) continue;
    if (bus::DecodeCdr(message.data, &sample)) samples.push_back(sample);
  }
  return samples;
}

TEST(Lerobot, HasAnEpisodeForEachRecording) {
  const testing::ShortSession first("lerobot_first", {.seconds = 1.6}, SmallPicture);
  const testing::ShortSession second("lerobot_second", {.seconds = 0.7}, SmallPicture);
  const fs::path set = first.folder() / "set", json = first.folder() / "lerobot.json";
  SaidBy("replayer", {first.recording(), second.recording(), "--lerobot", set, "--json", json}, 0);

  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(set)) {
    if (entry.is_regular_file()) files.insert(fs::relative(entry.path(), set));
  }
  EXPECT_EQ(files, (std::set<std::string>{"data/chunk-000/episode_000000.parquet",
                                          "data/chunk-000/episode_000001.parquet", "meta/episodes.jsonl",
                                          "meta/episodes_stats.jsonl", "meta/info.json", "meta/tasks.jsonl",
                                          "videos/chunk-000/observation.images.endoscope/episode_000000.mp4",
                                          "videos/chunk-000/observation.images.endoscope/episode_000001.mp4"}));
  const Json info = JsonOf(fulcrum::testing::ReadFile(set / "meta/info.json"));
  EXPECT_EQ(info.get<std::string>("codebase_version"), "v2.1");
  EXPECT_EQ(info.get<int>("total_episodes"), 2);
  EXPECT_EQ(info.get<int>("total_tasks"), 1) << "of one scene";
  EXPECT_EQ(info.get<int>("fps"), 30);
  const auto episodes = LinesOf(set / "meta/episodes.jsonl"), statistics = LinesOf(set / "meta/episodes_stats.jsonl");
  ASSERT_EQ(episodes.size(), 2u);
  ASSERT_EQ(statistics.size(), 2u);

  const std::vector<std::string> names = [&] {
    std::vector<std::string> all;
    // Names of features have dots.
    const auto& features = info.get_child("features");
    for (const auto& name : features.find("observation.state")->second.get_child("names")) {
      all.push_back(name.second.data());
    }
    return all;
  }();
  const auto place = [&](const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    EXPECT_NE(found, names.end()) << name;
    return static_cast<std::size_t>(found - names.begin());
  };
  std::int64_t index = 0;
  for (std::size_t e = 0; e < 2; ++e) {
    const std::string file = "/chunk-000/episode_00000" + std::to_string(e);
    const auto table = fulcrum::testing::ReadParquet(fulcrum::testing::ReadFile(set / ("data" + file + ".parquet")));
    const auto rows = static_cast<std::size_t>(table.rows);
    EXPECT_EQ(JsonOf(episodes[e]).get<std::size_t>("length"), rows);
    const std::string video = set / ("videos/chunk-000/observation.images.endoscope/episode_00000" + std::to_string(e));
    const std::string stream =
        SaidBy("/usr/bin/ffprobe", {"-v", "error", "-select_streams", "v", "-show_streams", video + ".mp4"}, 0);
    EXPECT_NE(stream.find("nb_frames=" + std::to_string(rows) + "\n"), std::string::npos) << stream;
    EXPECT_NE(stream.find("avg_frame_rate=30/1\n"), std::string::npos) << stream;
    EXPECT_NE(stream.find("start_time=0.000000\n"), std::string::npos) << stream;
    const auto& column = table.columns;
    ASSERT_EQ(column.size(), 8u);
    for (const auto& [name, of] : column) EXPECT_EQ(of.values.size(), rows) << name;
    const auto samples = ToolStatesOf(e == 0 ? first.recording() : second.recording());
    ASSERT_GT(samples.size(), 100u);
    double moved_m = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      const double time_s = static_cast<double>(i) / 30;
      EXPECT_NEAR(column.at("timestamp").values[i][0], time_s, 1e-6);
      EXPECT_EQ(column.at("frame_index").values[i][0], static_cast<double>(i));
      EXPECT_EQ(column.at("episode_index").values[i][0], static_cast<double>(e));
      EXPECT_EQ(column.at("index").values[i][0], static_cast<double>(index++));
      EXPECT_EQ(column.at("task_index").values[i][0], 0);
      EXPECT_EQ(column.at("next.done").values[i][0], i + 1 == rows ? 1 : 0);
      const auto &state = column.at("observation.state").values[i], &action = column.at("action").values[i];
      const auto& next = column.at("observation.state").values[std::min(i + 1, rows - 1)];
      ASSERT_EQ(state.size(), names.size());
      for (const auto& [tool, name] : {std::pair<std::size_t, std::string>{0, "grasper0"}, {1, "hook1"}}) {
        const std::size_t x = place(name + ".x");
        // Where the tip is at the picture's time: a millisecond off would show at any speed above 2 mm/s.
        const Vec3d tip_W(state[x], state[x + 1], state[x + 2]);
        EXPECT_NEAR((tip_W - TipAt(samples, tool, time_s)).norm(), 0, 2e-6) << name << " at " << time_s << " s";
        moved_m = std::max(moved_m, (tip_W - TipAt(samples, tool, 0)).norm());
        for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ(action[x - tool + k], next[x + k]) << name << " " << k;
      }
    }
    EXPECT_GT(moved_m, 1e-3);
    // The statistics are those of the rows.
    const Json of_state = JsonOf(statistics[e]).get_child("stats").find("observation.state")->second;
    const std::size_t x = place("hook1.x");
    double sum = 0;
    for (const auto& state : column.at("observation.state").values) sum += state[x];
    auto mean = of_state.get_child("mean").begin();
    std::advance(mean, static_cast<std::ptrdiff_t>(x));
    EXPECT_NEAR(mean->second.get_value<double>(), sum / static_cast<double>(rows), 1e-7);
  }
  const Json result = JsonOf(fulcrum::testing::ReadFile(json));
  EXPECT_EQ(info.get<std::int64_t>("total_frames"), index);
  EXPECT_EQ(result.get<std::int64_t>("frames"), index);
}

/// Mean of the corners of what is drawn of a tool.
Vec3d MiddleOf(int tool, render::RenderNode* node) {
  Vec3d sum = Vec3d::Zero();
  double count = 0;
  for (const render::DrawnSurface& surface : render::DrawnSurfaces(node->view().root())) {
    if (surface.tool != tool) continue;
    for (const Vec3d& p_W : surface.positions_W) sum += p_W;
    count += static_cast<double>(surface.positions_W.size());
  }
  EXPECT_GT(count, 0);
  return sum / count;
}

TEST(Lerobot, PicturesShowTheInstrumentsAsTheRowsHaveThem) {
  const testing::ShortSession session("lerobot_shown", {.seconds = 0.7}, SmallPicture);
  Projector projector(session.recording(), session.scene());
  projector.GoTo(0.6);
  render::Bitmap before, after;
  ASSERT_TRUE(projector.Draw(&before));
  render::RenderNode& node = projector.replay().node();
  KinematicState state;
  std::array<Vec3d, 2> middles;
  const Vec3d moved_m(0.004, -0.001, 0.002);
  for (std::size_t k = 0; k < middles.size(); ++k) {
    middles[k] = MiddleOf(static_cast<int>(k), &node);
    state.tools[k].tip_W = node.tools().tools[k].p_WT.cast<double>() + moved_m;
    state.tools[k].q_WT = node.tools().tools[k].q_WT.cast<double>();
    state.tools[k].jaw_rad = static_cast<double>(node.handles().handles[k].jaw_angle_rad);
  }
  node.DrawFrom(node.camera(), &before);
  ShowInstruments(state, session.scene(), &node);
  node.DrawFrom(node.camera(), &after);
  for (std::size_t k = 0; k < middles.size(); ++k) {
    // The jaw as given, not in the steps in which the renderer follows it.
    EXPECT_NEAR((MiddleOf(static_cast<int>(k), &node) - middles[k] - moved_m).norm(), 0, 1e-4) << k;
  }
  EXPECT_NE(before.rgb, after.rgb);
}

TEST(Lerobot, RefusesWhatMakesNoSet) {
  const testing::ShortSession session("no_lerobot", {.seconds = 0.3}, SmallPicture);
  const testing::ShortSession other("other_lerobot", {.seconds = 0.3});  // A picture of another size.
  const fs::path set = session.folder() / "set";
  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& words) {
    const std::string said = SaidBy("replayer", arguments, 2);
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  refused({session.recording(), "--lerobot", session.folder()}, "is not empty");
  refused({session.recording(), other.recording(), "--lerobot", set}, "another size of the picture");
  refused({session.recording(), other.recording(), "--video", "v.mp4"}, "only --lerobot takes several recordings");
  refused({session.recording(), "--lerobot", set, "--film"}, "give one of");
  EXPECT_FALSE(fs::exists(set));
}

}  // namespace
}  // namespace fulcrum::replay
