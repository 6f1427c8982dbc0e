// The replayer's pictures: a recorded session drawn twice.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/property_tree/json_parser.hpp>
#include <boost/property_tree/ptree.hpp>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "services/apps/replayer/projector.h"
#include "services/apps/replayer/variation.h"
#include "services/apps/replayer/video.h"
#include "services/scene/format/scene_file.h"
#include "tests/integration/replay/short_session.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"

namespace fulcrum::replay {
namespace {

constexpr double kPicturePatience_s = 100;  // A software rasteriser on a busy machine.

/// The files of a folder by name.
std::map<std::string, std::string> Pictures(const std::filesystem::path& folder) {
  std::map<std::string, std::string> pictures;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    pictures[entry.path().filename()] = fulcrum::testing::ReadFile(entry.path());
  }
  return pictures;
}

void Small(scene::SceneData* data) {
  testing::ShortSession::Hurry(data);
  data->fixed.render.width = 320;
  data->fixed.render.height = 180;
}

/// The answers of `replayer --film` after its first line.
struct Answers {
  double end_s = 0;
  std::vector<std::pair<double, std::string>> pictures;  ///< Time [s] and JPEG file.
};

Answers AnswersIn(const std::string& said) {
  Answers answers;
  std::istringstream stream(said);
  std::string word;
  stream >> word >> answers.end_s;
  EXPECT_EQ(word, "end") << said.substr(0, 400);
  double time_s = 0;
  for (std::size_t bytes = 0; stream >> time_s >> bytes;) {
    stream.ignore();  // The end of the line.
    answers.pictures.emplace_back(time_s, std::string(bytes, '\0'));
    stream.read(answers.pictures.back().second.data(), static_cast<std::streamsize>(bytes));
  }
  return answers;
}

TEST(Film, DrawsAnyTimeInAnyOrder) {
  const testing::ShortSession session("film_test", {.seconds = 1.6}, Small);
  fulcrum::testing::Program replayer("replayer", {session.recording(), "--film"}, "0\n0.41\n1.5\n0.4\n99\n");
  ASSERT_TRUE(fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return replayer.Poll().has_value(); }));
  const Answers answers = AnswersIn(replayer.Said());
  EXPECT_NEAR(answers.end_s, 1.6, 0.1);
  ASSERT_EQ(answers.pictures.size(), 5u) << "an answer for each line";
  const std::vector<double> asked{0, 0.41, 1.5, 0.4, 99};
  for (std::size_t i = 0; i < asked.size(); ++i) {
    EXPECT_EQ(answers.pictures[i].first, asked[i]);
    const std::string& jpeg = answers.pictures[i].second;
    EXPECT_TRUE(jpeg.empty() || jpeg.starts_with("\xff\xd8")) << asked[i];
  }
  EXPECT_FALSE(answers.pictures[0].second.empty()) << "the first picture, before there is one";
  EXPECT_FALSE(answers.pictures[2].second.empty());
  EXPECT_NE(answers.pictures[2].second, answers.pictures[0].second) << "the tools have moved";
  EXPECT_FALSE(answers.pictures[3].second.empty()) << "a step back";
}

TEST(Film, EndsAtALineThatIsNoTime) {
  const testing::ShortSession session("film_line_test", {.seconds = 0.5}, Small);
  fulcrum::testing::Program replayer("replayer", {session.recording(), "--film"}, "0.1\nsoon\n0.2\n");
  std::optional<int> code;
  fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return (code = replayer.Poll()).has_value(); });
  EXPECT_EQ(code, 2);
  EXPECT_NE(replayer.Said().find("\"soon\" is no session time"), std::string::npos);
}

/// Output of a program that ends well.
std::string OutputOf(const std::string& program, const std::vector<std::string>& arguments) {
  fulcrum::testing::Program run(program, arguments);
  std::optional<int> code;
  fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return (code = run.Poll()).has_value(); });
  EXPECT_EQ(code, 0) << program << ": " << run.Said();
  return run.Said();
}

std::ptrdiff_t Files(const std::filesystem::path& folder) {
  return std::distance(std::filesystem::directory_iterator(folder), {});
}

TEST(Video, ShowsEachTimeOfTheSession) {
  const testing::ShortSession session("video_test", {.seconds = 1.6}, Small);
  const std::filesystem::path video = session.folder() / "video.mp4", again = session.folder() / "again.mp4";
  const auto before = Files(session.folder());
  OutputOf("fulcrum", {"log", "video", session.recording()});
  OutputOf("replayer", {session.recording(), "--video", again, "--json", session.folder() / "video.json"});
  const std::string bytes = fulcrum::testing::ReadFile(video);
  EXPECT_TRUE(fulcrum::testing::ReadFile(again) == bytes) << "a second run";
  EXPECT_LT(bytes.find("moov"), bytes.find("mdat")) << "the index comes first";
  EXPECT_EQ(Files(session.folder()), before + 3) << "two videos and JSON: no other file remains";

  const std::string streams =
      OutputOf("/usr/bin/ffprobe", {"-v", "error", "-select_streams", "v", "-show_streams", "-show_chapters", video});
  EXPECT_NE(streams.find("codec_name=h264\n"), std::string::npos) << streams;
  EXPECT_NE(streams.find("avg_frame_rate=30/1\n"), std::string::npos) << streams;
  EXPECT_NE(streams.find("TAG:title=start\n"), std::string::npos) << streams;

  // Pictures of the file against those that are drawn for their time.
  Projector projector(session.recording(), session.scene());
  const auto count = static_cast<std::size_t>(projector.end_s() * kVideoRate_Hz + 1e-6) + 1;
  EXPECT_NE(streams.find("nb_frames=" + std::to_string(count) + "\n"), std::string::npos) << streams;
  const std::filesystem::path decoded = session.folder() / "decoded.rgb";
  OutputOf("/usr/bin/ffmpeg",
           {"-v", "error", "-i", video, "-vf", "vflip", "-f", "rawvideo", "-pix_fmt", "rgb24", decoded});
  const std::string pixels = fulcrum::testing::ReadFile(decoded);
  render::Bitmap drawn;
  const auto difference = [&](std::size_t picture) {
    const std::size_t begin = picture * drawn.rgb.size();
    double sum = 0;
    for (std::size_t i = 0; i < drawn.rgb.size(); ++i) {
      sum += std::abs(int{drawn.rgb[i]} - int{static_cast<std::uint8_t>(pixels[begin + i])});
    }
    return sum / static_cast<double>(drawn.rgb.size());
  };
  for (std::size_t i = 0; i < count; ++i) {
    projector.GoTo(static_cast<double>(i) / kVideoRate_Hz);
    (void)projector.Draw(&drawn);
    ASSERT_EQ(pixels.size(), count * drawn.rgb.size());
    EXPECT_LT(difference(i), 3.5) << "of 255, in the mean of picture " << i;
  }
  EXPECT_GT(difference(0), 3.5) << "the last picture is not the first";
}

TEST(Video, SaysWhyThereIsNone) {
  const testing::ShortSession session("no_video_test", {.seconds = 0.5}, Small);
  const auto expect = [&](int wanted, const std::vector<std::string>& arguments, const std::string& words) {
    std::vector<std::string> all{session.recording()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    fulcrum::testing::Program run("replayer", all);
    std::optional<int> code;
    fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return (code = run.Poll()).has_value(); });
    EXPECT_EQ(code, wanted) << run.Said();
    EXPECT_NE(run.Said().find(words), std::string::npos) << run.Said();
  };
  expect(2, {"--video", session.folder() / "missing" / "video.mp4"}, "cannot write");
  {
    const std::string path = std::getenv("PATH");
    ::setenv("PATH", session.folder().c_str(), 1);
    const auto files = Files(session.folder());
    expect(2, {"--video", session.folder() / "video.mp4"}, "ffmpeg is not installed");
    ::setenv("PATH", path.c_str(), 1);
    EXPECT_EQ(Files(session.folder()), files) << "nothing remains";
  }
  expect(2, {"--video", "video.mp4", "--within", "-1"}, "--within");
  expect(2, {"--video", "video.mp4", "--film"}, "give one of");
}

/// The files below a folder by their names from there.
std::map<std::string, std::string> FilesBelow(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[std::filesystem::relative(entry.path(), folder)] = fulcrum::testing::ReadFile(entry.path());
    }
  }
  return files;
}

TEST(Dataset, HasAllImagesOfEachFrameAndIsTheSameTwice) {
  const testing::ShortSession session("dataset_test", {.seconds = 1.6}, Small);
  const std::filesystem::path first = session.folder() / "first", second = session.folder() / "second";
  for (const auto& folder : {first, second}) {
    OutputOf("replayer", {session.recording(), "--dataset", folder, "--every", "0.4", "--until", "1.3"});
  }
  const auto files = FilesBelow(first);
  EXPECT_TRUE(files == FilesBelow(second));
  constexpr std::size_t kFrames = 4;  // 0, 0.4, 0.8 and 1.2 s.
  EXPECT_EQ(files.size(), 9 * kFrames + (kFrames - 1) + 4) << "nine images a frame, flow between them, four files";
  for (const auto& [name, format] : std::map<std::string, std::string>{{"left/000002.png", "rgb24"},
                                                                       {"right/000003.png", "rgb24"},
                                                                       {"depth/000003.png", "gray16be"},
                                                                       {"normal/000003.png", "rgb24"},
                                                                       {"flow/000002.png", "rgb48be"},
                                                                       {"instance/000000.png", "gray"},
                                                                       {"temperature/000001.png", "gray16be"},
                                                                       {"sheet.png", "rgb24"}}) {
    const std::string stream = OutputOf("/usr/bin/ffprobe", {"-v", "error", "-show_streams", first / name});
    EXPECT_NE(stream.find("pix_fmt=" + format + "\n"), std::string::npos) << name << "\n" << stream;
  }
  EXPECT_NE(files.at("left/000000.png"), files.at("right/000000.png"));

  boost::property_tree::ptree coco, calibration;
  boost::property_tree::read_json(first / "coco.json", coco);
  boost::property_tree::read_json(first / "calibration.json", calibration);
  EXPECT_EQ(coco.get_child("images").size(), kFrames);
  EXPECT_GE(coco.get_child("annotations").size(), 3 * kFrames) << "surroundings, sheet, instruments";
  for (const auto& [key, annotation] : coco.get_child("annotations")) {
    std::uint64_t all = 0, inside = 0, index = 0;
    for (const auto& [unused, run] : annotation.get_child("segmentation.counts")) {
      all += run.get_value<std::uint64_t>();
      inside += index++ % 2 == 1 ? run.get_value<std::uint64_t>() : 0;
    }
    EXPECT_EQ(all, 320u * 180u);
    EXPECT_EQ(inside, annotation.get<std::uint64_t>("area"));
  }
  EXPECT_EQ(calibration.get<int>("width"), 320);
  EXPECT_NEAR(calibration.get<double>("baseline_m"), 0.005, 1e-9);
  std::istringstream lines(files.at("frames.jsonl"));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    boost::property_tree::ptree frame;
    std::istringstream text(line);
    boost::property_tree::read_json(text, frame);
    EXPECT_NEAR(frame.get<double>("time_s"), 0.4 * static_cast<double>(count), 1e-9);
    EXPECT_EQ(frame.get_child("world_to_camera").size(), 4u);
    for (const auto& [unused, tool] : frame.get_child("tools")) EXPECT_EQ(tool.get_child("keypoints").size(), 3u);
  }
  EXPECT_EQ(count, kFrames);
}

TEST(Dataset, HasOneCameraAPictureAlsoWhereTheSceneHasStereo) {
  std::vector<std::map<std::string, std::string>> sets;
  std::vector<std::string> pictures;
  for (const StereoLayout layout : {StereoLayout::kNone, StereoLayout::kSideBySide}) {
    const auto change = [&](scene::SceneData* data) {
      Small(data);
      data->fixed.stereo.layout = layout;
    };
    const testing::ShortSession session("dataset_stereo_test", {.seconds = 1}, change);
    const std::filesystem::path folder = session.folder() / "set";
    OutputOf("replayer", {session.recording(), "--dataset", folder, "--every", "0.6", "--until", "0.7"});
    sets.push_back(FilesBelow(folder));
    Projector projector(session.recording(), session.scene());
    projector.GoTo(0.6);
    render::Bitmap picture;
    ASSERT_TRUE(projector.Draw(&picture));
    pictures.emplace_back(picture.rgb.begin(), picture.rgb.end());
  }
  EXPECT_TRUE(sets[0] == sets[1]);
  EXPECT_EQ(pictures[0].size(), pictures[1].size());
  EXPECT_NE(pictures[0], pictures[1]) << "a replay shows both eyes";
}

TEST(Dataset, VariesLightTissueAndScopeByItsSeed) {
  const testing::ShortSession session("vary_test", {.seconds = 0.5}, Small);
  const auto made = [&](const char* name, const char* seed) {
    const std::filesystem::path folder = session.folder() / name;
    OutputOf("replayer", {session.recording(), "--dataset", folder, "--every", "0.4", "--vary", "2", "--seed", seed});
    return FilesBelow(folder);
  };
  const auto first = made("first", "1");
  EXPECT_TRUE(first == made("second", "1")) << "the same seed, the same files";
  const auto other = made("other", "2");
  std::set<std::string> matrices, pictures;
  for (const auto* files : {&first, &other}) {
    for (const std::string folder : {"000", "001"}) {
      ASSERT_EQ(files->count(folder + "/coco.json"), 1u) << "each is a data set of its own";
      const std::string frames = files->at(folder + "/frames.jsonl");
      const std::size_t begin = frames.find("world_to_camera");
      matrices.insert(frames.substr(begin, frames.find("]]", begin) - begin));
      pictures.insert(files->at(folder + "/left/000000.png"));
    }
  }
  EXPECT_EQ(matrices.size(), 4u);
  EXPECT_EQ(pictures.size(), 4u);
  EXPECT_EQ(std::ranges::count(first.at("variations.jsonl"), '\n'), 2);
}

/// Mean of each channel of the session's first picture with a look.
std::array<double, 3> MeanWith(const testing::ShortSession& session, const render::Look& look) {
  const scene::SceneFile file(session.folder() / "scene.fulcrum");
  Projector projector(session.recording(), file.view(), look);
  projector.GoTo(0.3);
  render::Bitmap picture;
  EXPECT_TRUE(projector.Draw(&picture));
  std::array<double, 3> mean{};
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) mean[i % 3] += 3.0 * picture.rgb[i] / picture.rgb.size();
  return mean;
}

TEST(Dataset, AVariationStaysWithinWhatIsPromised) {
  SceneView scene;
  scene.render.fov_deg = 145;
  scene.render.scope_tip_W = {0, -0.1f, 0.12f};  // As shipped scenes look; of steeper ones: variation_test.
  const Vec3d back = (scene.render.scope_tip_W - scene.render.scope_target_W).cast<double>();
  float darkest = 9, brightest = 0;
  for (std::uint32_t i = 0; i < 300; ++i) {
    const Variation variation = VariationOf(scene, 7, i);
    const RenderParams& moved = variation.camera;
    const Vec3d turned = (moved.scope_tip_W - moved.scope_target_W).cast<double>();
    EXPECT_NEAR(turned.norm(), back.norm(), 0.1001 * back.norm());
    EXPECT_LE(std::acos(turned.normalized().dot(back.normalized())), std::numbers::pi / 18 * std::sqrt(2) + 1e-3);
    EXPECT_LE((moved.scope_target_W - scene.render.scope_target_W).cwiseAbs().maxCoeff(), 0.00401f);
    EXPECT_LE(std::abs(moved.roll_deg), 12.001f);
    EXPECT_LE(moved.fov_deg, 150) << "as in a scene";
    EXPECT_GE(moved.fov_deg, 0.9f * 145 - 0.001f);
    EXPECT_EQ(moved.width, scene.render.width);
    EXPECT_NEAR(variation.look.tissue.mean(), 1, 0.151);
    EXPECT_NE(variation.look.patterns, 0u);
    darkest = std::min(darkest, variation.look.light.y());
    brightest = std::max(brightest, variation.look.light.y());
  }
  EXPECT_NEAR(darkest, 0.6, 0.02);
  EXPECT_NEAR(brightest, 1.5, 0.02);
}

TEST(Dataset, AScopeThatTheSessionHoldsKeepsItsPose) {
  SceneView scene;
  scene.tools[1].kind = ToolKind::kScope;
  const Variation variation = VariationOf(scene, 7, 3);
  EXPECT_EQ(variation.camera.scope_tip_W, scene.render.scope_tip_W);
  EXPECT_EQ(variation.camera.scope_target_W, scene.render.scope_target_W);
  EXPECT_NE(variation.camera.fov_deg, scene.render.fov_deg);
  EXPECT_NE(VariationText(7, 3, variation).find("\"scope_tip_W\": null"), std::string::npos);
}

TEST(Dataset, ALookChangesLightAndTissue) {
  const testing::ShortSession session("look_test", {.seconds = 0.5}, Small);
  const auto plain = MeanWith(session, {}), bluer = MeanWith(session, {.light = Vec3f(1, 1, 1.3f)});
  EXPECT_GT(bluer[2], 1.05 * plain[2]);
  EXPECT_NEAR(bluer[0], plain[0], 0.1);
  const auto paler = MeanWith(session, {.tissue = Vec3f(1, 1.3f, 1)});
  EXPECT_GT(paler[1], 1.05 * plain[1]);
  EXPECT_NEAR(paler[0], plain[0], 0.1);
}

TEST(Dataset, DestroysNoFolderAndRefusesImpossibleSteps) {
  const testing::ShortSession session("no_dataset_test", {.seconds = 0.5}, Small);
  const auto expect_refused = [&](const std::vector<std::string>& arguments, const std::string& words) {
    std::vector<std::string> all{session.recording()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    fulcrum::testing::Program run("replayer", all);
    std::optional<int> code;
    fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return (code = run.Poll()).has_value(); });
    EXPECT_EQ(code, 2) << run.Said();
    EXPECT_NE(run.Said().find(words), std::string::npos) << run.Said();
  };
  const auto before = FilesBelow(session.folder());
  expect_refused({"--dataset", session.folder()}, "is not empty");
  expect_refused({"--dataset", session.folder() / "d", "--every", "0"}, "--every");
  expect_refused({"--dataset", session.folder() / "d", "--baseline", "-1"}, "--baseline");
  expect_refused({"--dataset", session.folder() / "d", "--vary", "1001"}, "--vary");
  expect_refused({"--dataset", session.folder() / "d", "--vary", "-1"}, "--vary");
  expect_refused({"--dataset", session.folder() / "d", "--vary", "1", "--seed", "-1"}, "--seed");
  expect_refused({"--dataset", session.folder() / "d", "--vary", "1", "--seed", "one"}, "seed");
  EXPECT_TRUE(FilesBelow(session.folder()) == before);
}

void FourPicturesASecond(scene::SceneData* data) {
  Small(data);
  data->fixed.render.rate_Hz = 4;
  data->fixed.render.png_rate_Hz = 4;
}

/// The files that `replayer --into render` writes into a folder `name` of the session.
std::map<std::string, std::string> Drawn(const testing::ShortSession& session, const char* name) {
  const std::filesystem::path frames = session.folder() / name;
  fulcrum::testing::Program replayer("replayer", {session.recording(), "--into", "render", "--frames", frames});
  std::optional<int> code;
  fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return (code = replayer.Poll()).has_value(); });
  EXPECT_EQ(code, 0) << replayer.Said();
  return Pictures(frames);
}

TEST(IntoRender, ASampleThatNoNodeTakesChangesNoPicture) {
  int number = 0;
  const auto leave_out = [&](ToolState* /*sample*/) { return ++number != 50 && number != 80; };
  const auto spoil = [&](ToolState* sample) {
    ++number;
    constexpr std::int64_t kCentury_ns = 3'000'000'000'000'000'000;
    if (number == 50) sample->stamp.stamp_ns = kCentury_ns;
    if (number == 80) sample->tools[0].p_WT.x() = std::numeric_limits<float>::quiet_NaN();
    return true;
  };
  const testing::ShortSession without("pictures_without", {.seconds = 1, .tool_change = leave_out},
                                      FourPicturesASecond);
  ASSERT_GT(number, 80);
  number = 0;
  const testing::ShortSession spoilt("pictures_spoilt", {.seconds = 1, .tool_change = spoil}, FourPicturesASecond);
  const auto pictures = Drawn(without, "frames");
  ASSERT_GE(pictures.size(), 3u);
  EXPECT_TRUE(Drawn(spoilt, "frames") == pictures);
}

TEST(IntoRender, RefusesWhatWouldNotChangeThePictures) {
  const testing::ShortSession session("pictures_refused", {.seconds = 0.2}, FourPicturesASecond);
  using Words = std::vector<std::string>;
  const std::string json = session.folder() / "r.json";
  for (const auto& [more, option] :
       {std::pair<Words, std::string>{{"render", "--set", "physics.grip_force_N=4"}, "set"},
        {{"physics", "render", "--set", "physics.grip_force_N=4"}, "set"},
        {{"render", "--console"}, "console"},
        {{"physics", "render", "--console"}, "console"},
        {{"render", "--json", json}, "json"},
        {{"render", "--rate", "1"}, "rate"},
        {{"render", "--threads", "2"}, "threads"}}) {
    Words words{session.recording(), "--into"};
    words.insert(words.end(), more.begin(), more.end());
    fulcrum::testing::Program replayer("replayer", words);
    EXPECT_EQ(replayer.End(0), 2) << option;
    EXPECT_NE(replayer.Said().find("--" + option + " cannot be combined with node render"), std::string::npos)
        << replayer.Said();
  }
  EXPECT_FALSE(std::filesystem::exists(session.folder() / "replayed_frames"));
}

TEST(IntoRender, DrawsTheSamePicturesToTheLastByteOrFails) {
  const testing::ShortSession session("pictures_test", {.seconds = 1.6}, FourPicturesASecond);
  const auto first = Drawn(session, "first"), second = Drawn(session, "second");
  ASSERT_GE(first.size(), 5u);
  std::set<std::string> different;
  for (const auto& [name, bytes] : first) {
    EXPECT_EQ(bytes.substr(0, 4), "\x89PNG") << name;
    ASSERT_TRUE(second.contains(name)) << name;
    EXPECT_TRUE(second.at(name) == bytes) << name;
    different.insert(bytes);
  }
  EXPECT_EQ(second.size(), first.size());
  EXPECT_EQ(different.size(), first.size()) << "the tools move from picture to picture";

  // A picture that cannot be written, here as a folder has its name.
  const std::filesystem::path frames = session.folder() / "third";
  std::filesystem::create_directories(frames / first.begin()->first);
  fulcrum::testing::Program replayer("replayer", {session.recording(), "--into", "render", "--frames", frames});
  std::optional<int> code;
  fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return (code = replayer.Poll()).has_value(); });
  EXPECT_EQ(code, 1);
  EXPECT_NE(replayer.Said().find(" pictures were not written to " + frames.string()), std::string::npos)
      << replayer.Said();
}

}  // namespace
}  // namespace fulcrum::replay
