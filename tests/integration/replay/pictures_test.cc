// The replayer's pictures: a recorded session drawn twice.
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

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

TEST(IntoRender, DrawsTheSamePicturesToTheLastByte) {
  const testing::ShortSession session("pictures_test", {.seconds = 1.6}, [](scene::SceneData* data) {
    Small(data);
    data->fixed.render.rate_Hz = 4;
    data->fixed.render.png_rate_Hz = 4;
  });
  const auto draw = [&](const char* name) {
    const std::filesystem::path frames = session.folder() / name;
    fulcrum::testing::Program replayer("replayer", {session.recording(), "--into", "render", "--frames", frames});
    std::optional<int> code;
    fulcrum::testing::WaitFor(kPicturePatience_s, [&] { return (code = replayer.Poll()).has_value(); });
    EXPECT_EQ(code, 0) << replayer.Said();
    return Pictures(frames);
  };
  const auto first = draw("first"), second = draw("second");
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
}

}  // namespace
}  // namespace fulcrum::replay
