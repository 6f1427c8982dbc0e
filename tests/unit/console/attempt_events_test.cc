// Events of an attempt are read in the background.
#include "services/session/console/attempt_events.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

std::string Wait(AttemptEvents* events, const fs::path& folder) {
  std::string json;
  for (int i = 0; i < 2000; ++i) {
    json = events->JsonOf(folder);
    if (json.find("\"ready\":true") != std::string::npos) return json;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return json;
}

TEST(AttemptEvents, SaysWhyThereAreNone) {
  const fs::path folder = fs::path(testing::TempDir()) / ("events_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  AttemptEvents events;
  EXPECT_NE(Wait(&events, folder / "missing").find("was not recorded"), std::string::npos);
  std::ofstream(folder / "recording.mcap") << "no recording";
  const std::string json = Wait(&events, folder);
  EXPECT_NE(json.find("recording.mcap"), std::string::npos) << json;
  EXPECT_NE(json.find("\"events\":[]"), std::string::npos) << json;
  // More folders than are kept.
  for (std::size_t i = 0; i < AttemptEvents::kMostKept + 4; ++i) {
    EXPECT_NE(Wait(&events, folder / std::to_string(i)).find("was not recorded"), std::string::npos);
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace fulcrum::console
