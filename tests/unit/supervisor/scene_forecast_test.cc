// What fulcrum up says before a session: the sentence, and that it is measured once a scene.
#include "services/session/supervisor/scene_forecast.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::supervisor {
namespace {
namespace fs = std::filesystem;

bool Says(const StepForecast& forecast, const char* what) { return Describe(forecast).find(what) != std::string::npos; }

TEST(SceneForecast, SaysWhetherStepsAreInTime) {
  EXPECT_TRUE(Says({10, 6, 4}, "steps of about 5.2 ms while tools work, up to 7.8 ms")) << Describe({10, 6, 4});
  EXPECT_TRUE(Says({10, 6, 4}, "in time"));
  EXPECT_TRUE(Says({10, 30, 10}, "about 50 of 100 Hz"));
  EXPECT_FALSE(Says({10, 30, 10}, "real time"));
  EXPECT_TRUE(Says({10, 90, 40}, "about 17 of 100 Hz, tissue at 50 % of real time")) << Describe({10, 90, 40});
  EXPECT_TRUE(Says({10, 20, 0}, "steps of about 26 ms; the period is 10 ms")) << "no script";
}

TEST(SceneForecast, IsMeasuredOnceForASceneOfTheCache) {
  const TemporaryFolder folder;
  const fs::path scene = folder.path() / "a.fulcrum", profiler = folder.path() / "profiler",
                 calls = folder.path() / "calls";
  std::ofstream(scene) << "compiled";
  EXPECT_EQ(ForecastOf(scene, folder.path(), profiler, 1), "") << "no such program";
  std::ofstream(profiler) << "#!/bin/sh\necho once >>" << calls.string()
                          << "\nprintf 'a 10 ms\\nb 6 ms\\nc 4 ms\\n' >\"$5\"\n";
  fs::permissions(profiler, fs::perms::owner_all);
  const std::string line = ForecastOf(scene, folder.path(), profiler, 1);
  EXPECT_NE(line.find("in time"), std::string::npos) << line;
  EXPECT_EQ(ForecastOf(scene, folder.path(), profiler, 1), line);
  std::ifstream in(calls);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "once\n");
  EXPECT_EQ(ForecastOf(scene, folder.path() / "elsewhere", profiler, 1), "") << "not of the cache";
  std::ofstream(profiler) << "#!/bin/sh\nexit 1\n";
  fs::remove(folder.path() / "a.fulcrum.forecast1");
  EXPECT_EQ(ForecastOf(scene, folder.path(), profiler, 1), "");
  std::ofstream(profiler) << "#!/bin/sh\necho twice >>" << calls.string() << "\n";
  EXPECT_EQ(ForecastOf(scene, folder.path(), profiler, 1), "") << "not tried again";
  EXPECT_EQ(fs::file_size(calls), 5u);
}

}  // namespace
}  // namespace fulcrum::supervisor
