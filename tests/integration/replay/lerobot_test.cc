// The replayer's set for robot learning, against the recordings that it was made of.
#include "services/apps/replayer/lerobot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/property_tree/json_parser.hpp>
#include <boost/property_tree/ptree.hpp>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "render_node/scene_graph/drawn_surfaces.h"
#include "services/apps/replayer/projector.h"
#include "services/apps/replayer/recorded_kinematics.h"
#include "services/base/core/contact_force.h"
#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/mcap_writer.h"
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

/// H.264 wants even sizes.
void OddPicture(scene::SceneData* data) {
  SmallPicture(data);
  data->fixed.render.width = 321;
  data->fixed.render.height = 181;
}

std::string SaidBy(const std::string& program, const std::vector<std::string>& arguments, int wanted_code) {
  constexpr double kPatience_s = 300;  // A software rasteriser on a busy machine.
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

template <class T>
std::vector<T> SamplesOf(const fs::path& recording) {
  recording::McapReader reader(recording);
  std::vector<T> samples;
  T sample;
  for (recording::McapMessage message{}; reader.Next(&message);) {
    if (reader.channels().at(message.channel).topic != bus::RoleOf<T>().name) continue;
    if (bus::DecodeCdr(message.data, &sample)) samples.push_back(sample);
  }
  return samples;
}

/// The recorded samples before and after a session time, and the share of the second one.
template <class T>
struct Around {
  Around(const std::vector<T>& samples, double time_s) {
    const double stamp_ns = testing::kCartStart_ns + 1e9 * time_s;
    std::size_t next = 0;
    while (next + 1 < samples.size() && static_cast<double>(samples[next].stamp.stamp_ns) <= stamp_ns) ++next;
    before = &samples[next > 0 ? next - 1 : 0];
    after = &samples[next];
    const double begin = static_cast<double>(before->stamp.stamp_ns), end = static_cast<double>(after->stamp.stamp_ns);
    share = end > begin ? std::clamp((stamp_ns - begin) / (end - begin), 0.0, 1.0) : 0;
  }
  /// Of a value of a sample: linear between the two.
  template <class Value>
  [[nodiscard]] auto Linear(const Value& value) const -> decltype(value(std::declval<const T&>())) {
    return (1 - share) * value(*before) + share * value(*after);
  }
  const T *before, *after;
  double share;
};

/// Recorded place of a tool's tip at a session time [m].
Vec3d TipAt(const std::vector<ToolState>& samples, std::size_t tool, double time_s) {
  return Around<ToolState>(samples, time_s).Linear([&](const ToolState& sample) -> Vec3d {
    return sample.tools[tool].p_WT.cast<double>();
  });
}

/// All samples of a recording that make rows.
struct Samples {
  explicit Samples(const fs::path& recording)
      : tools(SamplesOf<ToolState>(recording)),
        handles(SamplesOf<HandleState>(recording)),
        contacts(SamplesOf<ContactModel>(recording)) {}

  /// A tool's values behind its place, and the pedals, are those of the recording. Returns the force [N].
  double Expect(const std::vector<double>& state, std::size_t tool, std::size_t x, std::size_t pedals,
                double time_s) const {
    const Around<ToolState> tool_at(tools, time_s);
    Eigen::Vector4d q = tool_at.Linear([&](const ToolState& sample) -> Eigen::Vector4d {
      const Quatf& q_WT = sample.tools[tool].q_WT;
      const double sign = q_WT.dot(tool_at.before->tools[tool].q_WT) < 0 ? -1 : 1;
      return sign * Eigen::Vector4d(static_cast<double>(q_WT.x()), static_cast<double>(q_WT.y()),
                                    static_cast<double>(q_WT.z()), static_cast<double>(q_WT.w()));
    });
    const Eigen::Vector4d row(state[x + 3], state[x + 4], state[x + 5], state[x + 6]);
    if (row.dot(q) < 0) q = -q;  // The same orientation.
    EXPECT_NEAR((row - q.normalized()).norm(), 0, 1e-5) << tool << " at " << time_s << " s";
    const Around<HandleState> handle_at(handles, time_s);
    const double jaw_rad = handle_at.Linear(
        [&](const HandleState& sample) { return static_cast<double>(sample.handles[tool].jaw_angle_rad); });
    EXPECT_NEAR(state[x + 7], jaw_rad, 1e-6) << tool << " at " << time_s << " s";
    const double force_N = Around<ContactModel>(contacts, time_s).Linear([&](const ContactModel& sample) {
      return TissueForce(sample.devices[tool]).norm();
    });
    EXPECT_NEAR(state[x + 8], force_N, 1e-5 * (1 + force_N)) << tool << " at " << time_s << " s";
    std::size_t at = pedals;
    for (const std::uint8_t pedal : {kPedalCut, kPedalCoag, kPedalBlend}) {
      EXPECT_EQ(state[at++], (handle_at.before->pedals & pedal) != 0 ? 1 : 0) << int{pedal} << " at " << time_s << " s";
    }
    return force_N;
  }

  std::vector<ToolState> tools;
  std::vector<HandleState> handles;
  std::vector<ContactModel> contacts;
};

/// The name of a file as info.json gives it for an episode of the first chunk.
std::string Expanded(std::string name, const std::string& episode) {
  for (const auto& [key, value] : {std::pair<std::string, std::string>{"{episode_chunk:03d}", "000"},
                                   {"{episode_index:06d}", episode},
                                   {"{video_key}", "observation.images.endoscope"}}) {
    if (const std::size_t at = name.find(key); at != std::string::npos) name.replace(at, key.size(), value);
  }
  return name;
}

TEST(Lerobot, HasAnEpisodeForEachRecording) {
  const testing::ShortSession first("lerobot_first", {.seconds = 1.6}, OddPicture);
  const testing::ShortSession second("lerobot_second", {.seconds = 0.7}, OddPicture);
  // The source text is not part of what makes a scene another one.
  scene::WriteSceneFile(second.scene(), "description: Cut the \"sheet\"\n", second.folder() / "scene.fulcrum");
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
  EXPECT_EQ(info.get<int>("total_tasks"), 2) << "one scene has a description";
  const auto tasks = LinesOf(set / "meta/tasks.jsonl");
  ASSERT_EQ(tasks.size(), 2u);
  EXPECT_EQ(JsonOf(tasks[0]).get<std::string>("task"), std::string(first.scene().name));
  EXPECT_EQ(JsonOf(tasks[1]).get<std::string>("task"), "Cut the \"sheet\"");
  EXPECT_EQ(info.get<int>("fps"), 30);
  const auto episodes = LinesOf(set / "meta/episodes.jsonl"), statistics = LinesOf(set / "meta/episodes_stats.jsonl");
  ASSERT_EQ(episodes.size(), 2u);
  ASSERT_EQ(statistics.size(), 2u);

  const Json& features = info.get_child("features");
  const std::vector<std::string> names = [&] {
    std::vector<std::string> all;
    // Names of features have dots.
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
    EXPECT_NE(stream.find("width=322\n"), std::string::npos) << stream;
    EXPECT_NE(stream.find("height=182\n"), std::string::npos) << stream;
    const std::string flags = SaidBy(
        "/usr/bin/ffprobe", {"-v", "error", "-show_entries", "packet=flags", "-of", "csv=p=0", video + ".mp4"}, 0);
    EXPECT_GE(2 * std::count(flags.begin(), flags.end(), 'K'), static_cast<std::ptrdiff_t>(rows)) << flags;
    const std::string episode = "00000" + std::to_string(e);
    for (const char* path : {"data_path", "video_path"}) {
      const std::string name = Expanded(info.get<std::string>(path), episode);
      EXPECT_TRUE(fs::is_regular_file(set / name)) << name;
    }
    const auto& column = table.columns;
    ASSERT_EQ(column.size(), 8u);
    for (const auto& [name, of] : column) {
      ASSERT_EQ(of.values.size(), rows) << name;
      const auto feature = features.find(name);
      ASSERT_NE(feature, features.not_found()) << name;
      const Json& shape = feature->second.get_child("shape");
      ASSERT_EQ(shape.size(), 1u) << name;
      for (const auto& row : of.values) EXPECT_EQ(row.size(), shape.front().second.get_value<std::size_t>()) << name;
    }
    const Samples recorded(e == 0 ? first.recording() : second.recording());
    const std::vector<ToolState>& samples = recorded.tools;
    ASSERT_GT(samples.size(), 100u);
    double moved_m = 0, force_N = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      const double time_s = static_cast<double>(i) / 30;
      EXPECT_NEAR(column.at("timestamp").values[i][0], time_s, 1e-6);
      EXPECT_EQ(column.at("frame_index").values[i][0], static_cast<double>(i));
      EXPECT_EQ(column.at("episode_index").values[i][0], static_cast<double>(e));
      EXPECT_EQ(column.at("index").values[i][0], static_cast<double>(index++));
      EXPECT_EQ(column.at("task_index").values[i][0], static_cast<double>(e));
      EXPECT_EQ(column.at("next.done").values[i][0], i + 1 == rows ? 1 : 0);
      const auto &state = column.at("observation.state").values[i], &action = column.at("action").values[i];
      const auto& next = column.at("observation.state").values[std::min(i + 1, rows - 1)];
      ASSERT_EQ(state.size(), names.size());
      for (const auto& [tool, name] : {std::pair<std::size_t, std::string>{0, "grasper0"}, {1, "hook1"}}) {
        const std::size_t x = place(name + ".x");
        // Where the tip is at the picture's time: a millisecond off would show at any speed above 2 mm/s.
        const Vec3d tip_W(state[x], state[x + 1], state[x + 2]);
        EXPECT_NEAR((tip_W - TipAt(samples, tool, time_s)).norm(), 0, 2e-6) << name << " at " << time_s << " s";
        force_N = std::max(force_N, recorded.Expect(state, tool, x, place("pedal.cut"), time_s));
        moved_m = std::max(moved_m, (tip_W - TipAt(samples, tool, 0)).norm());
        for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ(action[x - tool + k], next[x + k]) << name << " " << k;
      }
    }
    EXPECT_GT(moved_m, 1e-3);
    if (e == 0) {
      EXPECT_GT(force_N, 0) << "the longer session has contact";
    }
    // The statistics are those of the rows.
    const Json of_state = JsonOf(statistics[e]).get_child("stats").find("observation.state")->second;
    const std::size_t x = place("hook1.x");
    double sum = 0;
    for (const auto& state : column.at("observation.state").values) sum += state[x];
    auto mean = of_state.get_child("mean").begin();
    std::advance(mean, static_cast<std::ptrdiff_t>(x));
    EXPECT_NEAR(mean->second.get_value<double>(), sum / static_cast<double>(rows), 1e-7);
  }
  std::vector<int> size;
  for (const auto& each : features.find("observation.images.endoscope")->second.get_child("shape")) {
    size.push_back(each.second.get_value<int>());
  }
  EXPECT_EQ(size, (std::vector<int>{182, 322, 3}));
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

TEST(Lerobot, TakesNoSampleThatANodeRefuses) {
  constexpr std::int64_t kCentury_ns = 3'000'000'000'000'000'000;
  int number = 0;
  const auto spoil = [&](ToolState* sample) {
    ++number;
    if (number == 100) sample->tools[0].p_WT.x() = std::numeric_limits<float>::quiet_NaN();
    if (number == 150) sample->stamp.stamp_ns = kCentury_ns;
    if (number == 200) sample->stamp.epoch = static_cast<std::uint64_t>(kCentury_ns);
    if (number == 100 || number == 150 || number == 200) sample->tools[0].p_WT.y() = 9;
    return true;
  };
  const testing::ShortSession session("lerobot_spoilt", {.seconds = 0.7, .tool_change = spoil}, SmallPicture);
  std::vector<ToolState> good;
  for (const ToolState& sample : SamplesOf<ToolState>(session.recording())) {
    const bool spoilt = sample.tools[0].p_WT.hasNaN() || sample.stamp.stamp_ns == kCentury_ns ||
                        sample.stamp.epoch == static_cast<std::uint64_t>(kCentury_ns);
    if (!spoilt) good.push_back(sample);
  }
  ASSERT_EQ(good.size() + 3, static_cast<std::size_t>(number));
  EXPECT_NEAR(ReadSpan(session.recording(), session.scene()).end_s, 0.7, 0.002);
  const Kinematics read = ReadKinematics(session.recording(), session.scene(), 0.7);
  for (int ms = 0; ms < 700; ++ms) {
    const Vec3d tip_W = read.At(testing::kCartStart_ns + 1'000'000 * ms).tools[0].tip_W;
    EXPECT_NEAR((tip_W - TipAt(good, 0, 1e-3 * ms)).norm(), 0, 2e-6) << ms << " ms";
  }
}

/// A recording of 1,200 s with the first and the last sample only.
void WriteLong(const fs::path& file, const SceneView& scene) {
  recording::McapWriter writer(file, "", "test");
  const auto write = [&](const auto& sample) {
    using T = std::decay_t<decltype(sample)>;
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(bus::EncodeCdr(sample, &bytes));
    const auto stamp_ns = static_cast<std::uint64_t>(sample.stamp.stamp_ns);
    writer.Write(writer.AddChannel(0, bus::RoleOf<T>().name, "cdr", {{"at", std::to_string(stamp_ns)}}), 1, stamp_ns,
                 stamp_ns, std::as_bytes(std::span(bytes)));
  };
  SceneManifest manifest;
  manifest.stamp = {1, testing::kCartStart_ns, testing::kCartStart_ns};
  manifest.scene_name = scene.name;
  manifest.session_id = "test";
  manifest.scene_hash = scene.hash;
  manifest.session_start_ns = testing::kCartStart_ns;
  write(manifest);
  ToolState tools;
  for (const std::int64_t time_ns : {std::int64_t{0}, std::int64_t{1'200'000'000'000}}) {
    tools.stamp = {1, testing::kCartStart_ns, testing::kCartStart_ns + time_ns};
    write(tools);
  }
  // Not decoded before a picture is drawn.
  writer.Write(writer.AddChannel(0, bus::RoleOf<TissueFrame>().name, "cdr", {}), 1, testing::kCartStart_ns,
               testing::kCartStart_ns, std::as_bytes(std::span("none")));
  writer.Close();
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
  for (const char* option : {"--every", "--baseline", "--vary", "--seed"}) {
    refused({session.recording(), "--lerobot", set, option, "1"}, option + std::string(" cannot be combined"));
  }
  const std::string late = session.folder() / "late.mcap", scene = session.folder() / "scene.fulcrum";
  WriteLong(late, session.scene());
  refused({session.recording(), late, "--scene", scene, "--lerobot", set}, "valid: 0 to 1000 s");
  refused({session.recording(), late, "--scene", scene, "--lerobot", set}, "leave out " + late);
  refused({late, "--scene", scene, "--lerobot", set}, "--until 1000");
  EXPECT_FALSE(fs::exists(set));
}

}  // namespace
}  // namespace fulcrum::replay
