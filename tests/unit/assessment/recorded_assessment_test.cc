// A recorded session gives the same measures as the live one.
#include "services/session/assessment/recorded_assessment.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "services/base/core/error.h"
#include "services/records/recording/mcap_writer.h"
#include "services/session/assessment/assessor.h"
#include "services/session/assessment/recorded_timeline.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/topics.h"
#include "tests/support/assessment_cases.h"

namespace fulcrum::assessment {
namespace {

namespace fs = std::filesystem;

/// Passes each message of an artificial session to `put`, in the order in which a recorder would receive them.
template <class Put>
void Play(const Put& put) {
  for (int i = -50; i < 4200; ++i) {
    const double time_s = 1e-3 * i;
    put(test::ToolAt(time_s, Vec3d(0.05 * std::sin(time_s), 0.02 * std::cos(2 * time_s), 0),
                     Vec3d(1e-3 * time_s, 0, 0)));
    if (i % 10 != 0) continue;
    put(i < 2000 ? test::GraspAt(time_s, Vec3d(0, 0, 5e-3 * time_s), 3 * time_s, 5) : test::PushAt(time_s, 2));
    const auto along = static_cast<float>(0.02 + 0.008 * time_s);
    put(test::TipAt(time_s, Vec2f(0.0212f, along), i % 300 > 40));
    put(test::PedalAt(time_s, CauteryMode::kCut));
    if (i % 500 != 0) continue;
    ThermalEvent event;
    event.stamp = test::StampAt(time_s);
    event.session_time_s = time_s;
    event.kind = ThermalEventKind::kUreterWarning;
    put(event);
    TopologyState topology;
    topology.stamp = test::StampAt(time_s);
    topology.rows = topology.cols = 2;
    topology.dead_nodes = {0};
    topology.dead_edges = topology.shrink = {0, 0};
    topology.shrink.resize(12);
    topology.cut_length_m = static_cast<float>(1e-3 * time_s);
    put(topology);
    put(test::PatchAt(time_s, 100, 200, [&](const Eigen::Vector2d& at) { return at.y() < 0.02 + 0.002 * time_s; }));
  }
}

class RecordedSession : public testing::Test {
 protected:
  static constexpr double kEnd_s = 4;
  RecordedSession() { fs::create_directory(folder_); }
  ~RecordedSession() override { fs::remove_all(folder_); }

  struct Told {
    bool manifest = true, end = true;
    std::uint64_t scene_hash = 0;
  };
  fs::path Record(const Told& told) const {
    fs::path file = folder_ / "session.mcap";
    recording::McapWriter writer(file, "fulcrum", "fulcrum test");
    std::map<TopicId, std::uint16_t> channels;
    std::uint32_t sequence = 0;
    const auto put = [&]<class T>(const T& message) {
      constexpr TopicId id = bus::kTopicOf<T>;
      const std::string type(bus::TopicLabel(id));
      if (!channels.contains(id)) {
        const std::uint16_t schema = writer.AddSchema("fulcrum::idl::" + type, "omgidl", bus::SchemaText(type));
        channels[id] = writer.AddChannel(schema, bus::RoleOf(id).name, "cdr", {{"node", "some_node"}});
      }
      std::vector<std::uint8_t> bytes;
      EXPECT_TRUE(bus::EncodeCdr(message, &bytes)) << type;
      ++sequence;
      writer.Write(channels[id], sequence, 1000 * sequence, 1000 * sequence, std::as_bytes(std::span(bytes)));
    };
    SceneManifest manifest;
    manifest.stamp = test::StampAt(-0.2);
    manifest.scene_name = "x";
    manifest.session_id = "s-1";
    manifest.scene_hash = told.scene_hash;
    manifest.session_start_ns = test::kStart_ns;
    if (told.manifest) put(manifest);
    Play(put);
    Health health;
    health.stamp = test::StampAt(4.3);
    health.state = HealthState::kStopping;
    health.metrics = {{"session_time_s", kEnd_s}};
    if (told.end) put(health);
    return file;
  }

  test::AssessedScene scene_;
  const fs::path folder_ = fs::path(testing::TempDir()) / ("assess_" + std::to_string(getpid()));
};

TEST_F(RecordedSession, SameMessagesGiveTheSameFigures) {
  Assessor live(scene_.view);
  live.Begin(test::kStart_ns);
  live.End(kEnd_s);
  Play([&](const auto& message) { live.Add(message); });
  live.Finish();
  const Figures wanted = live.figures();
  const RecordedAssessment got = AssessRecording(Record({}), scene_.view);
  EXPECT_EQ(got.session_id, "s-1");
  EXPECT_EQ(got.end_s, kEnd_s);
  int known = 0;
  const auto same = [&](const MeasureValues& a, const MeasureValues& b) {
    for (std::size_t i = 0; i < kMeasureCount; ++i) {
      known += std::isnan(a[i]) ? 0 : 1;
      EXPECT_TRUE(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i])))
          << kMeasures[i].key << ": live " << a[i] << ", recorded " << b[i];
    }
  };
  same(wanted.session, got.figures.session);
  same(wanted.tool[0], got.figures.tool[0]);
  same(wanted.tool[1], got.figures.tool[1]);
  EXPECT_GT(known, 30);
  // Both sides use the same Assessor; these figures of Play are known without it. Grasp at up to 6 N with a grip of 5
  // N, 10 mm of rise in 2 s, then 2 N of pressure to the end.
  const auto of = [&](Measure measure) { return got.figures.session[static_cast<std::size_t>(measure)]; };
  EXPECT_NEAR(of(Measure::kPeakForce), 3 * 1.99, 1e-3);
  EXPECT_NEAR(of(Measure::kForceTime), 3 * 1.99 * 1.99 / 2 + 2 * 2, 0.1);
  EXPECT_NEAR(of(Measure::kLift), 5 * 1.99, 0.01);
  EXPECT_EQ(of(Measure::kGraspSlips), 1);
  EXPECT_EQ(of(Measure::kUreterWarnings), 9) << "one every half second from 0 to 4 s";
  EXPECT_NEAR(of(Measure::kCutLength), 4, 1e-3) << "1 mm a second";
  EXPECT_GT(wanted.session[static_cast<std::size_t>(Measure::kDamageBeyondMargin)], 0);
}

TEST_F(RecordedSession, ARecordingThatWasCutOffIsMeasuredToItsLastMessage) {
  const RecordedAssessment got = AssessRecording(Record({.manifest = true, .end = false}), scene_.view);
  EXPECT_NEAR(got.end_s, 4.199, 1e-6);
}

TEST_F(RecordedSession, ItsTimeLineIsThatOfTheMessages) {
  Timeline live(test::kStart_ns);
  Play([&](const auto& message) {
    if constexpr (requires { live.Add(message); }) live.Add(message);
  });
  const RecordedTimeline got = ReadTimeline(Record({}));
  const std::vector<Happening> wanted = live.happenings();
  ASSERT_EQ(got.happenings.size(), wanted.size());
  EXPECT_EQ(wanted.size(), 6u) << "two touches, a hold and its end, a pedal, one warning that repeats";
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(got.happenings[i].time_s, wanted[i].time_s);
    EXPECT_EQ(got.happenings[i].until_s, wanted[i].until_s);
    EXPECT_EQ(TextOf(got.happenings[i]), TextOf(wanted[i]));
  }
  EXPECT_THROW((void)ReadTimeline(Record({.manifest = false})), InputError);
  EXPECT_THROW((void)ReadTimeline(folder_ / "none.mcap"), InputError);
}

TEST_F(RecordedSession, WhatCannotBeMeasuredIsRefusedWithTheReason) {
  const auto refusal = [&](const fs::path& file, const SceneView& scene) -> std::string {
    try {
      (void)AssessRecording(file, scene);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  EXPECT_NE(refusal(Record({.manifest = false}), scene_.view).find("no session begins in it"), std::string::npos);
  EXPECT_NE(refusal(Record({.scene_hash = 5}), scene_.view).find("another scene"), std::string::npos);
  SceneView plain = scene_.view;
  plain.assessment.on = 0;
  EXPECT_NE(refusal(folder_ / "none.mcap", plain).find("no section `assessment`"), std::string::npos);
  EXPECT_NE(refusal(folder_ / "none.mcap", scene_.view).find("none.mcap"), std::string::npos);
}

}  // namespace
}  // namespace fulcrum::assessment
