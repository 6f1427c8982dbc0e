#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "services/base/runtime/child_process.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "services/session/soak/chaos_plan.h"
#include "services/session/soak/process_table.h"
#include "services/session/soak/script_rounds.h"
#include "services/session/soak/soak_page.h"
#include "services/session/soak/soak_record.h"

namespace fulcrum::soak {
namespace {

const std::vector<std::string> kFive{"a", "b", "c", "d", "e"};

TEST(ChaosPlan, SameSeedSameBlowsWithinTheTimeAndEachNodeInTurn) {
  const std::vector<Blow> blows = PlanChaos(3, kFive, 10, 600, 8), again = PlanChaos(3, kFive, 10, 600, 8);
  ASSERT_EQ(blows.size(), again.size());
  EXPECT_NEAR(static_cast<double>(blows.size()), 590 / 8., 15);
  std::set<BlowKind> kinds;
  std::vector<std::string> met;
  for (std::size_t i = 0; i < blows.size(); ++i) {
    EXPECT_EQ(blows[i].time_s, again[i].time_s);
    EXPECT_EQ(blows[i].node, again[i].node);
    EXPECT_GE(blows[i].time_s, i == 0 ? 10 : blows[i - 1].time_s + 4 - 1e-9);
    EXPECT_LT(blows[i].time_s, 600);
    kinds.insert(blows[i].kind);
    EXPECT_EQ(blows[i].node.empty(), blows[i].kind == BlowKind::kCrowd);
    if (!blows[i].node.empty()) met.push_back(blows[i].node);
  }
  EXPECT_EQ(kinds.size(), 3u);
  for (std::size_t i = 1; i < met.size(); ++i) {
    EXPECT_EQ(met[i][0], met[i - 1][0] == 'e' ? 'a' : met[i - 1][0] + 1);
  }
  EXPECT_NE(PlanChaos(4, kFive, 10, 600, 8)[1].time_s, blows[1].time_s);
  EXPECT_TRUE(PlanChaos(3, {}, 10, 600, 8).empty());
}

ScriptKey Key(float time_s, std::uint32_t tool, std::uint32_t pedals = 0) {
  return {time_s, tool, Vec3f(time_s, 0, 0), 0, pedals, pedals != 0 ? 35.0f : 0.0f};
}

TEST(ScriptRounds, RepeatsEachToolWithPedalsUpInBetween) {
  const std::vector<ScriptKey> script{Key(0, 0), Key(4, 0), Key(0, 1), Key(1, 1, kPedalCut), Key(4, 1, kPedalCut)};
  const std::vector<ScriptKey> rounds = ScriptRounds(script, 5, 17);
  std::vector<float> times[2];
  for (const ScriptKey& key : rounds) times[key.tool].push_back(key.time_s);
  EXPECT_EQ(times[0], (std::vector<float>{0, 4, 7, 11, 14}));
  // The cut's last key is followed by one with the pedal up, at the end of each whole round.
  EXPECT_EQ(times[1], (std::vector<float>{0, 1, 4, 5, 7, 8, 11, 12, 14, 15}));
  for (const ScriptKey& key : rounds) {
    const float in_round = std::fmod(key.time_s, 7.0f);
    EXPECT_EQ(key.pedals != 0, key.tool == 1 && (in_round == 1 || in_round == 4)) << key.tool << " " << key.time_s;
    if (in_round < 5) {
      EXPECT_EQ(key.p_W.x(), in_round);
    }
  }
}

TEST(ScriptRounds, AKeyAtTheVeryEndOfTheScriptEndsTheRound) {
  const std::vector<ScriptKey> rounds = ScriptRounds(std::vector<ScriptKey>{Key(0, 0), Key(5, 0, kPedalCut)}, 5, 12);
  ASSERT_EQ(rounds.size(), 4u);
  EXPECT_EQ(rounds[1].pedals, 0u);
  EXPECT_EQ(rounds[1].power_W, 0.0f);
  EXPECT_EQ(rounds[3].time_s, 12.0f);
}

TEST(ScriptRounds, TheSceneOfRoundsIsValidAndOtherwiseTheSame) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "rounds";
  std::filesystem::create_directories(folder);
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  scene::WriteSceneFile(data, "source", folder / "one.fulcrum");
  WriteSceneOfRounds(folder / "one.fulcrum", 200, folder / "many.fulcrum");
  const scene::SceneFile many(folder / "many.fulcrum");
  EXPECT_EQ(many.view().script_duration_s, 200);
  EXPECT_GT(many.view().script.size(), 4 * data.script.size());
  EXPECT_EQ(many.view().rest_position.size(), data.rest_position.size());
  EXPECT_EQ(many.source_yaml(), "source");
  std::filesystem::remove_all(folder);
}

TEST(ProcessTable, KnowsChildrenAndWhatTheyHold) {
  auto child = runtime::ChildProcess::Start("/bin/sleep", {"20"}, "/dev/null");
  EXPECT_GT(ResidentBytes(::getpid()).value_or(0), 1'000'000u);
  std::map<std::string, pid_t> children;
  // Until the shell has become `sleep`.
  for (int i = 0; i < 1000 && !children.contains("sleep"); ++i) {
    children = ChildrenOf(::getpid());
    ::usleep(1000);
  }
  ASSERT_EQ(children.count("sleep"), 1u);
  EXPECT_EQ(children.find("sleep")->second, child.pid());
  EXPECT_GT(ResidentBytes(child.pid()).value_or(0), 0u);
  child.Signal(SIGKILL);
  while (ChildrenOf(::getpid()).contains("sleep")) ::usleep(1000);
  EXPECT_FALSE(ResidentBytes(child.pid()).has_value()) << "it is a zombie";
}

TEST(ProcessTable, TheNodeIsOlderThanItsSpareWhateverTheirNumbers) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("process_table_test." + std::to_string(::getpid()));
  // Numbers of processes have wrapped: the spare of the node 30001 is 301, that of 302 is 30002.
  const auto add = [&](int process, const std::string& name, int start) {
    const std::filesystem::path at = folder / std::to_string(process);
    std::filesystem::create_directories(at);
    std::ofstream(at / "status") << "Name:\t" << name << "\nState:\tS (sleeping)\nPPid:\t7\n";
    std::ofstream(at / "stat") << process << " (" << name << ") S 7 1 1 0 -1 4194304 9 8 7 6 5 4 3 2 20 0 12 0 "
                               << start << " 1000 250\n";
  };
  add(301, "render_node", 900);
  add(30001, "render_node", 100);
  add(302, "odd ) name", 100);
  add(30002, "odd ) name", 900);
  const std::map<std::string, pid_t> expected{{"render_node", 30001}, {"odd ) name", 302}};
  EXPECT_EQ(ChildrenOf(7, folder), expected);
  EXPECT_TRUE(ChildrenOf(8, folder).empty());
  std::filesystem::remove_all(folder);
}

TEST(ProcessTable, ProcessorsGoOnCounting) {
  const ProcessorTimes before = ReadProcessorTimes();
  EXPECT_GT(before.all, before.stolen);
  ProcessorTimes after = before;
  while (after.all == before.all) after = ReadProcessorTimes();
  EXPECT_GT(after.all, before.all);
  EXPECT_GE(after.stolen, before.stolen);
}

/// A node that grows by `leak_MB_per_min` over `minutes`.
SoakRecord Grown(double minutes, double leak_MB_per_min) {
  SoakRecord record;
  for (int s = 0; s < 60 * minutes; ++s) {
    // The memory of the start is no leak.
    const double MB = 100 * std::min(1.0, (s + 1) / 10.0) + leak_MB_per_min * s / 60.0;
    record.AddMemory(s, "physics_node", 10, static_cast<std::uint64_t>(1e6 * MB));
    record.SetAlive({10});
  }
  record.End(60 * minutes, true, "");
  return record;
}

TEST(SoakRecord, GrowthIsWhatComesAfterTheStart) {
  EXPECT_NEAR(Grown(10, 0).LargestGrowth_MB(), 0, 1e-9);
  // From the period 30 … 40 s to the last 10 s.
  EXPECT_NEAR(Grown(10, 3).LargestGrowth_MB(), 3 * (595 - 35) / 60.0, 0.1);
  EXPECT_TRUE(Grown(10, 1).Passes({}));
  EXPECT_FALSE(Grown(10, 3).Passes({}));
  EXPECT_NEAR(Grown(0.5, 0).LargestGrowth_MB(), 0, 1e-9) << "short sessions have shorter times";
}

TEST(SoakRecord, WhoIsKilledHasNotCrashed) {
  SoakRecord record;
  for (const std::int32_t process : {1, 2, 3}) record.AddMemory(0, "node", process, 1);
  record.AddBlow({1, BlowKind::kKill, "node", 0}, 1);
  record.AddBlow({1, BlowKind::kFreeze, "node", 0.1}, 2);
  record.SetAlive({2, 3});
  EXPECT_EQ(record.crashes(), 0);
  record.SetAlive({3});
  EXPECT_EQ(record.crashes(), 1) << "a node that freezes and ends is a crash";
  record.AddMemory(2, "node", 1, 1);  // The process id of the first is reused.
  record.SetAlive({3});
  EXPECT_EQ(record.crashes(), 2);
  EXPECT_FALSE(record.Passes({})) << "it has not ended";
  record.End(10, false, "killed");
  EXPECT_EQ(record.crashes(), 3);
  EXPECT_EQ(record.Count(BlowKind::kKill), 1);
}

TEST(SoakRecord, DriftIsTheDistanceOfPeriodsFromTheClock) {
  SoakRecord record;
  record.AddMemory(0, "physics_node", 10, 1);
  Health health;
  health.pid = 10;
  health.state = HealthState::kRunning;
  health.rate_asked_Hz = 100;
  for (int i = 0; i < 100; ++i) {
    health.stamp.stamp_ns = 1'000'000'000 + i * std::int64_t{100'000'000};
    health.ticks = 7 + 9 * static_cast<std::uint64_t>(i);  // A tenth of the periods is skipped …
    health.overruns = static_cast<std::uint64_t>(i);       // … and counted,
    if (i > 50) health.ticks -= 2;                         // except for two.
    health.rate_achieved_Hz = 90;
    record.AddHealth(0.1 * i, health);
  }
  record.End(10, true, "");
  EXPECT_NEAR(record.LargestDrift_ms(), 20, 1e-6);
  EXPECT_NEAR(record.LowestRate_pct(), 90, 1e-6);
}

TEST(SoakPage, ShowsFiguresCurvesAndWhatWasDone) {
  SoakRecord record = Grown(2, 30);
  record.AddBlow({5, BlowKind::kKill, "physics_node", 0}, 10);
  const std::string page = SoakPage(record, {}, "<small>", "latest");
  for (const char* part : {"soak.rss_growth_MB", "not well", "Resident memory", "killed on purpose", "&lt;small&gt;",
                           "latest/report.html"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(page.find("Rate of what"), std::string::npos) << "no Health of it was received";
  EXPECT_TRUE(
      SamplesCsv(record).starts_with("time_s,program,process,figure,value\n0.0,physics_node,10,memory_MB,10.0"));
}

}  // namespace
}  // namespace fulcrum::soak
