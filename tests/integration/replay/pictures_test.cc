// The replayer's pictures: a recorded session drawn twice.
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>

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

TEST(IntoRender, DrawsTheSamePicturesToTheLastByte) {
  const testing::ShortSession session("pictures_test", {.seconds = 1.6}, [](scene::SceneData* data) {
    testing::ShortSession::Hurry(data);
    data->fixed.render.width = 320;
    data->fixed.render.height = 180;
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
