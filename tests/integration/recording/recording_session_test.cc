// Recordings of real processes over the real bus.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "services/records/log_tools/tools.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/gate.h"
#include "tests/support/cart.h"
#include "tests/support/recorder_probe.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::Cart;
using testing::Program;
using testing::RecorderProbe;

constexpr int kCartDomain = 56, kProbeDomain = 60;

TEST(RecordedCart, EveryTopicIsInTheFileAndDecodes) {
  // Long enough for the hook to have cut something.
  Cart cart("small", kCartDomain, {"--record", "--seconds", "120"});
  ASSERT_TRUE(testing::WaitFor(60, [&] { return cart.PictureTime() >= 3.4; })) << cart.Said();
  // A command and its reply: this session has no recorder for dumps, so the dump is refused.
  EXPECT_EQ(Program("fulcrum", {"dump", "--domain", std::to_string(kCartDomain)}).End(0), 1);
  cart.Signal(SIGINT);
  EXPECT_EQ(cart.FaultAtEnd(60), "");
  EXPECT_NE(cart.Said().find("recording.mcap"), std::string::npos) << "the report names it\n" << cart.Said();
  const fs::path file = cart.session() / "recording.mcap";

  // Every node began after the recorder had reported that it reads the node's writers, and none at its deadline.
  for (const auto& log : fs::directory_iterator(cart.session() / "logs")) {
    EXPECT_EQ(testing::ReadFile(log.path()).find("no recorder reads"), std::string::npos) << log.path();
  }

  log_tools::Recording recording(file);
  log_tools::Entry entry;
  std::map<std::string, int> decoded;
  std::map<std::string, std::pair<std::uint32_t, std::uint32_t>> sequences;  // First and last.
  std::uint64_t scene_hash = 0;
  while (recording.Next(&entry)) {
    ASSERT_TRUE(entry.source->topic.has_value()) << entry.source->name;
    EXPECT_FALSE(entry.source->node.empty()) << entry.source->name;
    const bool good = log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&](const auto& message) {
      EXPECT_TRUE(bus::PassesGate(message)) << entry.source->name;
      if constexpr (std::is_same_v<decltype(message), const SceneManifest&>) scene_hash = message.scene_hash;
    });
    ASSERT_TRUE(good) << entry.source->name;
    ++decoded[entry.source->name];
    sequences.try_emplace(entry.source->name, entry.message.sequence, 0).first->second.second = entry.message.sequence;
  }
  for (const bus::TopicRole& role : bus::kTopicRoles) {
    if (!role.recorded()) {
      EXPECT_EQ(decoded[std::string(bus::TopicLabel(role.id))], 0) << role.name;
      continue;
    }
    // This scene has no tear, no clip applier and no operator's input.
    if (role.id == TopicId::kTearState || role.id == TopicId::kClipState || role.id == TopicId::kOperatorInput)
      continue;
    EXPECT_GE(decoded[std::string(bus::TopicLabel(role.id))], 1) << role.name;
  }
  // The number of samples depends on the machine; nearly all of them must be in the file.
  for (const std::string topic : {"ToolState", "TissueFrame"}) {
    const auto [first, last] = sequences[topic];
    EXPECT_GT(decoded[topic], 100) << topic;
    EXPECT_GT(decoded[topic], 0.9 * (last - first + 1)) << topic;
  }
  EXPECT_TRUE(recording.reader().closed());
  EXPECT_TRUE(recording.reader().faults().empty());
  // The arguments of `fulcrum up` may name a trainee, who can ask for the name to be deleted.
  for (const auto& [number, channel] : recording.reader().channels()) {
    const std::string& command = channel.metadata.at("command");
    EXPECT_FALSE(command.empty()) << channel.topic;
    EXPECT_EQ(command.find("--"), std::string::npos) << channel.topic << ": " << command;
  }
  const auto& metadata = recording.reader().metadata();
  EXPECT_EQ(std::stoull(metadata.at("session").at("scene_hash"), nullptr, 16), scene_hash);
  EXPECT_EQ(metadata.at("session").at("scene"), "small");
  EXPECT_NE(metadata.at("cart").at("yaml").find("physics_node"), std::string::npos);

  // Input for tests of third-party readers.
  fs::copy_file(file, fs::path(FULCRUM_BIN_DIR).parent_path() / "recorded_session.mcap",
                fs::copy_options::overwrite_existing);
}

TEST(KilledRecorder, LeavesAFileWithAllThatIsOlderThanASecond) {
  RecorderProbe probe(kProbeDomain);
  for (int kill = 0; kill < 2; ++kill) {
    const RecorderProbe::Result result = probe.RecordAndKill(1.7 + 0.13 * kill);
    EXPECT_GT(result.due, 400u);
    EXPECT_EQ(result.read, result.due);
    EXPECT_LT(result.unread_ms, 1000);
    const fs::path mended = result.file.parent_path() / ("mended" + std::to_string(kill) + ".mcap");
    EXPECT_FALSE(log_tools::Recover(result.file, mended).empty()) << "the file was not closed";
    log_tools::Recording whole(mended);
    log_tools::Entry entry;
    while (whole.Next(&entry)) {
    }
    EXPECT_TRUE(whole.reader().closed());
    EXPECT_TRUE(whole.reader().faults().empty());
  }
}

TEST(FullDisk, EndsARecordingInOrderWithAllSamplesSentBefore) {
  RecorderProbe probe(kProbeDomain);
  const RecorderProbe::FullDisk result = probe.RecordUntilFull(40'000'000, 4);
  EXPECT_TRUE(result.has_ended);
  EXPECT_GT(result.recorded, 100u);
  EXPECT_EQ(result.lost, 0u);
}

TEST(RestartedRecorder, LeavesOneRecordingThatNamesTheBreak) {
  Cart cart("small", kCartDomain, {"--record", "--seconds", "120"});
  const auto grows = [&](const char* name) {
    const fs::path file = cart.session() / name;
    std::error_code not_there;
    return testing::WaitFor(60, [&] { return fs::file_size(file, not_there) > 1'000'000 && !not_there; });
  };
  ASSERT_TRUE(grows("recording.mcap")) << "a break lies between two files that have something\n" << cart.Said();
  ::kill(cart.nodes().at("recorder"), SIGKILL);
  ASSERT_TRUE(grows("recording-2.mcap")) << cart.Said();
  cart.Signal(SIGINT);
  EXPECT_TRUE(cart.WaitForEnd(60).has_value()) << cart.Said();
  EXPECT_NE(cart.Said().find("2 files of the recording were joined; "), std::string::npos) << cart.Said();
  EXPECT_FALSE(fs::exists(cart.session() / "recording-2.mcap"));
  log_tools::Recording recording(cart.session() / "recording.mcap");
  log_tools::Entry entry;
  double last_s = 0;
  std::map<std::uint16_t, std::uint32_t> last;
  while (recording.Next(&entry)) {
    const auto [newest, is_first] = last.try_emplace(entry.message.channel, entry.message.sequence);
    EXPECT_TRUE(is_first || entry.message.sequence > newest->second) << entry.source->name << ": recorded twice";
    newest->second = entry.message.sequence;
    last_s = entry.time_s;
  }
  const double session_s = testing::FigureOf(testing::ReadFile(cart.session() / "summary.json"), "session_seconds");
  EXPECT_GT(last_s, session_s - 1) << "recorded up to the end of the session";
  EXPECT_TRUE(recording.reader().closed());
  EXPECT_NE(recording.reader().metadata().at("merged").at("breaks"), "");
}

/// `fulcrum up` with a recording and, unlike Cart, its video.
class FilmedSession {
 public:
  explicit FilmedSession(const std::string& scene = "small")
      : up_("fulcrum",
            {"up", scene, "--record", "--seconds", "2", "--domain", std::to_string(kCartDomain), "--out", folder_}) {}
  ~FilmedSession() {
    up_ = Program();
    fs::remove_all(folder_);
  }
  FilmedSession(const FilmedSession&) = delete;
  FilmedSession& operator=(const FilmedSession&) = delete;

  [[nodiscard]] const Program& up() const { return up_; }
  void ExpectEndsWell() {
    std::optional<int> code;
    testing::WaitFor(180, [&] { return (code = up_.Poll()).has_value(); });
    EXPECT_EQ(testing::FaultBesidePace(code.value_or(-1), up_.Said()), "");
  }
  [[nodiscard]] fs::path video() const { return folder_ / "latest" / "video.mp4"; }
  [[nodiscard]] std::string report() const { return testing::ReadFile(folder_ / "latest" / "report.html"); }

 private:
  const fs::path folder_ = fs::temp_directory_path() / ("fulcrum-filmed-" + std::to_string(::getpid()));
  Program up_;
};

TEST(RecordedCart, TheReportContainsTheVideo) {
  FilmedSession session;
  session.ExpectEndsWell();
  EXPECT_GT(fs::file_size(session.video()), 10'000u);
  EXPECT_NE(session.report().find("data:video/mp4;base64,"), std::string::npos);
  EXPECT_NE(session.report().find("0:00 start"), std::string::npos) << "its chapters";
}

TEST(RecordedCart, TheVideoIsDrawnWithTheSceneOfTheSession) {
  const fs::path scene = fs::temp_directory_path() / ("filmed-" + std::to_string(::getpid()) + ".fulcrum");
  ASSERT_EQ(Program("scene_compiler", {FULCRUM_SOURCE_DIR "/deploy/scenes/small.yaml", "--out", scene}).End(0), 0);
  FilmedSession session(scene);
  ASSERT_TRUE(testing::WaitFor(60, [&] { return session.up().Said().find(" s · ") != std::string::npos; }))
      << session.up().Said();
  fs::remove(scene);  // As one that was compiled again, or left the cache.
  session.ExpectEndsWell();
  EXPECT_TRUE(fs::exists(session.video())) << session.up().Said();
}

TEST(RecordedCart, TheNextSessionNeedNotWaitForTheVideo) {
  FilmedSession session;
  ASSERT_TRUE(testing::WaitFor(60, [&] { return session.up().Said().find("drawing the video") != std::string::npos; }))
      << session.up().Said();
  Cart next("small", kCartDomain, {"--seconds", "300"});
  ASSERT_TRUE(testing::WaitFor(60, [&] { return next.Said().find(" s · ") != std::string::npos; })) << next.Said();
  session.ExpectEndsWell();  // While the next one goes on.
  EXPECT_EQ(Program("fulcrum", {"status", "--domain", std::to_string(kCartDomain)}).End(0), 0);
  EXPECT_TRUE(fs::exists(bus::SharedMemoryDirectory(kCartDomain))) << "of the next one";
  next.Signal(SIGINT);
  EXPECT_EQ(next.FaultAtEnd(60), "");
  EXPECT_TRUE(fs::exists(session.video())) << session.up().Said();
}

TEST(RecordedCart, CtrlCLeavesTheVideoOut) {
  FilmedSession session;
  ASSERT_TRUE(testing::WaitFor(60, [&] { return session.up().Said().find("drawing the video") != std::string::npos; }))
      << session.up().Said();
  session.up().Signal(SIGINT);
  session.ExpectEndsWell();
  for (const auto& file : fs::directory_iterator(session.video().parent_path())) {
    EXPECT_FALSE(file.path().filename().string().starts_with("video.mp4")) << file.path();
  }
  EXPECT_NE(session.report().find("fulcrum log video"), std::string::npos) << "how to draw it later";
}

}  // namespace
}  // namespace fulcrum
