// The assessment: known results, exclusions, prompts, points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "services/session/assessment/assessor.h"
#include "services/session/assessment/smoothness.h"
#include "tests/support/assessment_cases.h"

namespace fulcrum::assessment {
namespace {

using test::AddTip;
using test::KnownAnswer;
using test::PatchAt;
using test::PushAt;
using test::StampAt;
using test::ToolAt;

double ValueOf(const Assessor& assessor, Measure measure) {
  return assessor.figures().session[static_cast<std::size_t>(measure)];
}

struct Running {
  Running() : assessor(scene.view) { assessor.Begin(test::kStart_ns); }
  test::AssessedScene scene;
  Assessor assessor;
};

TEST(Assessment, KnownAnswersAreFoundWithinOnePercent) {
  std::set<std::string> seen;
  for (const KnownAnswer& answer : test::KnownAnswers()) {
    EXPECT_LE(answer.error_pct(), 1.0) << answer.name << ": " << answer.measured << ", known: " << answer.known;
    seen.insert(answer.name.substr(0, answer.name.find('.')));
  }
  for (const MeasureInfo& info : kMeasures) EXPECT_TRUE(seen.contains(info.name)) << info.name;
}

TEST(Smoothness, IsThatOfTheShapeAndNotOfSizeOrDuration) {
  const auto reach = [](int samples, double peak) {
    std::vector<double> speed;
    for (int i = 0; i <= samples; ++i) {
      const double u = static_cast<double>(i) / samples;
      speed.push_back(peak * 16 * u * u * (1 - u) * (1 - u));
    }
    return SpectralArcLength(speed, 100);
  };
  EXPECT_NEAR(reach(100, 0.1), reach(100, 3.0), 1e-12);
  EXPECT_NEAR(reach(100, 1), reach(240, 1), 0.005 * std::abs(reach(100, 1)));
}

TEST(Smoothness, OfNothingIsNotANumber) {
  EXPECT_TRUE(std::isnan(SpectralArcLength({}, 100)));
  EXPECT_TRUE(std::isnan(SpectralArcLength(std::vector<double>(50, 0.0), 100)));
}

TEST(Assessment, NothingCountsBeforeTheSessionNorAfterItsEnd) {
  Running run;
  run.assessor.End(2);
  for (int i = -1000; i < 4000; ++i) {
    const double time_s = 1e-3 * i, far = time_s < 0 ? 0.1 : time_s > 2 ? 0.2 : 0;
    run.assessor.Add(ToolAt(time_s, Vec3d(far, 0, 0), Vec3d::Zero()));
  }
  for (int i = -100; i < 400; ++i) run.assessor.Add(PushAt(0.01 * i, i < 0 || i > 200 ? 14 : 1));
  run.assessor.Finish();
  EXPECT_EQ(ValueOf(run.assessor, Measure::kPathLength), 0);
  EXPECT_NEAR(ValueOf(run.assessor, Measure::kPeakForce), 1, 1e-6);
  EXPECT_NEAR(ValueOf(run.assessor, Measure::kForceTime), 2, 1e-6);
}

TEST(Assessment, ASilenceIsNotCounted) {
  Running run;
  for (const double from_s : {0.0, 5.0}) {
    for (int i = 0; i <= 1000; ++i) {
      const double time_s = from_s + 1e-3 * i;
      run.assessor.Add(ToolAt(time_s, Vec3d(from_s, 0, 0), Vec3d::Zero()));
      if (i % 10 == 0) run.assessor.Add(PushAt(time_s, 3));
      if (i % 10 == 0) AddTip(time_s, Vec2f::Zero(), false, CauteryMode::kCut, &run.assessor);
    }
  }
  EXPECT_EQ(ValueOf(run.assessor, Measure::kPathLength), 0) << "the jump after a loss of the tool does not count";
  EXPECT_NEAR(ValueOf(run.assessor, Measure::kForceTime), 6, 1e-6);
  EXPECT_NEAR(ValueOf(run.assessor, Measure::kPedalWithoutContact), 2, 1e-6);
}

TEST(Assessment, TheOrderBetweenTopicsDoesNotMatter) {
  const auto figures = [](bool tools_first) {
    Running run;
    const auto tools = [&] {
      for (int i = 0; i < 3000; ++i)
        run.assessor.Add(ToolAt(1e-3 * i, Vec3d(0.1 * test::MinimumJerk(i / 3000.0), 0, 0), Vec3d::Zero()));
    };
    if (tools_first) tools();
    for (int i = 0; i < 300; ++i) run.assessor.Add(PushAt(0.01 * i, 0.01 * i));
    for (int i = 0; i < 300; ++i)
      AddTip(0.01 * i, Vec2f(0.021f, 0.02f + 1e-4f * static_cast<float>(i)), true, CauteryMode::kCut, &run.assessor);
    if (!tools_first) tools();
    run.assessor.Finish();
    return run.assessor.figures();
  };
  const Figures a = figures(true), b = figures(false);
  for (std::size_t i = 0; i < kMeasureCount; ++i) {
    EXPECT_TRUE(a.session[i] == b.session[i] || (std::isnan(a.session[i]) && std::isnan(b.session[i])))
        << kMeasures[i].key;
  }
}

TEST(Assessment, APhysicsNodeThatComesBackIsNoSlip) {
  Running run;
  for (int i = 0; i < 300; ++i) {
    ContactModel model = test::GraspAt(0.01 * i, Vec3d::Zero(), 3, 8);
    if (i >= 150) model.stamp.epoch = 2;
    if (i >= 150 && i < 155) model.devices[0].count = 0;  // The grasp is not restored yet.
    run.assessor.Add(model);
  }
  EXPECT_EQ(ValueOf(run.assessor, Measure::kGraspSlips), 0);
}

/// Two graspers: a sum over the tools, a time from the first movement to the last, whichever tool moves.
TEST(Assessment, WhatTwoToolsDoIsAdded) {
  test::AssessedScene scene;
  scene.view.tools[1].kind = ToolKind::kGrasper;
  Assessor assessor(scene.view);
  assessor.Begin(test::kStart_ns);
  const auto reach = [](double since_s, double lasts_s) {
    return Vec3d(0.1 * test::MinimumJerk(std::clamp(since_s / lasts_s, 0.0, 1.0)), 0, 0);
  };
  for (int i = 0; i < 6000; ++i) {
    const double time_s = 1e-3 * i;
    assessor.Add(ToolAt(time_s, reach(time_s - 1, 3), reach(time_s - 1.5, 1)));
    if (i % 10 != 0) continue;
    ContactModel model = test::GraspAt(time_s, Vec3d::Zero(), i > 2000 && i < 2500 ? 9 : 3, 8);
    model.devices[1] = test::GraspAt(time_s, Vec3d::Zero(), i > 3000 && i < 3500 ? 9 : 3, 8).devices[0];
    assessor.Add(model);
  }
  assessor.Finish();
  const Figures figures = assessor.figures();
  EXPECT_NEAR(ValueOf(assessor, Measure::kPathLength), 200, 1);
  EXPECT_EQ(ValueOf(assessor, Measure::kGraspSlips), 2);
  const double longer_s = figures.tool[0][static_cast<std::size_t>(Measure::kTime)];
  EXPECT_GT(longer_s, 2);
  EXPECT_EQ(ValueOf(assessor, Measure::kTime), longer_s) << "the short reach of tool 1 lies within that of tool 0";
}

/// An assistant (tool 0 keeps a traction by itself) swings, pulls too hard and loses tissue: none of it is the
/// trainee's, who reaches once, in a second.
TEST(Assessment, WhatAnAssistantDoesIsNotCounted) {
  test::AssessedScene scene;
  scene.view.tools[0].traction_N = 1;
  Assessor assessor(scene.view);
  assessor.Begin(test::kStart_ns);
  for (int i = 0; i < 8000; ++i) {
    const double time_s = 1e-3 * i, swing = 0.1 * std::sin(4 * time_s);
    const double way = 0.1 * test::MinimumJerk(std::clamp(time_s - 3, 0.0, 1.0));
    assessor.Add(ToolAt(time_s, Vec3d(swing, 0, 0), Vec3d(way, 0, 0)));
    if (i % 10 != 0) continue;
    ContactModel model = test::GraspAt(time_s, Vec3d::Zero(), i < 5000 ? 14 : 3, 8);
    model.devices[1] = test::PushAt(time_s, 2).devices[1];
    assessor.Add(model);
    EXPECT_EQ(assessor.PromptsAt(time_s + 0.01), 0u) << time_s;
  }
  assessor.Finish();
  EXPECT_NEAR(ValueOf(assessor, Measure::kPathLength), 100, 1);
  EXPECT_NEAR(ValueOf(assessor, Measure::kPeakForce), 2, 1e-6);
  EXPECT_LT(ValueOf(assessor, Measure::kTime), 1.1);
  EXPECT_NEAR(ValueOf(assessor, Measure::kIdle), 7, 0.5);
}

TEST(Assessment, BurntSurfaceCountsByOrganAndFatIsNone) {
  test::AssessedScene scene;
  std::array<Solid, 3> solids{};
  solids[0].look = SolidLook::kLiver;
  solids[1].look = SolidLook::kFat;
  solids[2].look = SolidLook::kUreter;
  scene.view.solids = solids;
  scene.view.tube_surface = {};
  EXPECT_TRUE(std::isnan(ValueOf(Assessor(scene.view), Measure::kOrganBurn))) << "no surface that can burn";
  scene.view.tube_surface = scene.surface;
  Assessor assessor(scene.view);
  assessor.Begin(test::kStart_ns);
  EXPECT_EQ(ValueOf(assessor, Measure::kOrganBurn), 0);
  ThermalEvent event;
  event.kind = ThermalEventKind::kSolidBurn;
  const auto burn = [&](double time_s, int solid, float mm2) {
    event.session_time_s = time_s;
    event.solid = static_cast<std::uint8_t>(solid);
    event.value = 1e-6f * mm2;
    assessor.Add(event);
  };
  burn(1, 1, 40);
  EXPECT_EQ(assessor.PromptsAt(1.1), 0u) << "fat is no organ";
  burn(2, 0, 1);
  burn(3, 0, 4);
  burn(4, 2, 2);
  burn(5, 0, 3);  // A node that has come back from an older checkpoint.
  burn(6, kNoSolid, 100);
  EXPECT_NEAR(ValueOf(assessor, Measure::kOrganBurn), 6, 1e-5);
}

TEST(Assessment, PatchesThatOverlapAndComeAgainCountOnce) {
  Running run;
  const auto block = [](const Eigen::Vector2d& at) {
    return at.x() > 0.024 && at.x() < 0.026 && at.y() > 0.03 && at.y() < 0.033;
  };
  for (int i = 0; i < 3; ++i) {
    run.assessor.Add(PatchAt(1 + i, 100, 200, block));
    run.assessor.Add(PatchAt(1 + i, 180, 210, block));
  }
  EXPECT_NEAR(ValueOf(run.assessor, Measure::kDamageBeyondMargin), 6, 0.05);
}

/// Collagen counts as coagulated at a damage integral of 1: a texel of 255 (1 - 1/e) = 161.2.
TEST(Assessment, DamageCountsFromAnIntegralOfOne) {
  for (const auto& [value, mm2] : {std::pair{160, 0.0}, {163, 6.0}}) {
    Running run;
    TemperaturePatch patch = PatchAt(1, 100, 200, [](const Eigen::Vector2d& at) {
      return at.x() > 0.024 && at.x() < 0.026 && at.y() > 0.03 && at.y() < 0.033;
    });
    for (std::size_t k = 1; k < patch.texels.size(); k += 4) {
      patch.texels[k] = static_cast<std::uint8_t>(patch.texels[k] == 200 ? value : 0);
    }
    run.assessor.Add(patch);
    EXPECT_NEAR(ValueOf(run.assessor, Measure::kDamageBeyondMargin), mm2, 0.05) << value;
  }
}

TEST(Assessment, WithoutALineNothingIsSaidOfIt) {
  test::AssessedScene scene;
  scene.view.planned_line = {};
  Assessor assessor(scene.view);
  EXPECT_FALSE(assessor.needs_patches());
  assessor.Begin(test::kStart_ns);
  AddTip(1, Vec2f(0.02f, 0.03f), true, CauteryMode::kCut, &assessor);
  EXPECT_TRUE(std::isnan(ValueOf(assessor, Measure::kLineDone)));
  const Score score = Evaluate(scene.view.assessment, assessor.figures());
  EXPECT_TRUE(std::none_of(score.items.begin(), score.items.end(),
                           [](const ScoreItem& item) { return item.measure == Measure::kDeviationMean; }));
}

/// AssessedScene with two sheets of 3 x 3 nodes, 12 mm apart: the fold lies above the membrane and in the atlas three
/// patches beside it. The membrane's middle is the middle of the planned line.
struct FoldScene : test::AssessedScene {
  FoldScene() {
    constexpr std::uint32_t kRows = 19, kCols = 3, kFold = 16;
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t col = 0; col < kCols; ++col) {
        const bool fold = row >= kFold;
        const float x = 0.02f * static_cast<float>(col), y = 0.02f * static_cast<float>(fold ? row - kFold : row);
        nodes.emplace_back(x - 0.02f, y - 0.02f, fold ? 0.012f : 0.0f);
        material.emplace_back(fold ? x + 0.0768f : x, y + 0.02f);
      }
    }
    view.membrane.rows = kRows;
    view.membrane.cols = kCols;
    view.rest_position = nodes;
    view.membrane_material = material;
    view.sheets = sheets;
    view.tools[2].kind = ToolKind::kScope;
    view.render.scope_angle_deg = 0;
  }
  std::vector<SheetPart> sheets{{"membrane", 0, 3, 3, kNoIndex}, {"fold", 16, 3, 3, kNoIndex}};
  std::vector<Vec3f> nodes;
  std::vector<Vec2f> material;
};

TEST(Assessment, WorkOnAnotherSheetIsNotMeasuredAgainstTheLine) {
  const FoldScene scene;
  Assessor assessor(scene.view);
  assessor.Begin(test::kStart_ns);
  for (int i = 0; i < 100; ++i) {
    AddTip(1 + 0.01 * i, Vec2f(0.09f, 0.03f + 1e-4f * static_cast<float>(i)), true, CauteryMode::kCoag, &assessor);
  }
  assessor.Add(PatchAt(1.5, 768, 0, [](const Eigen::Vector2d&) { return true; }));
  assessor.Finish();
  EXPECT_TRUE(std::isnan(ValueOf(assessor, Measure::kDeviationMax)));
  EXPECT_EQ(ValueOf(assessor, Measure::kDamageBeyondMargin), 0);
  EXPECT_EQ(ValueOf(assessor, Measure::kPedalWithoutContact), 0) << "it is a contact";
  EXPECT_EQ(assessor.PromptsAt(2), 0u) << "neither off the line nor near the ureter";
  AddTip(3, Vec2f(0.02f, 0.04f), true, CauteryMode::kCut, &assessor);
  AddTip(3.01, Vec2f(0.02f, 0.041f), true, CauteryMode::kCut, &assessor);
  assessor.Finish();
  EXPECT_NEAR(ValueOf(assessor, Measure::kDeviationMax), 0, 1e-4) << "the membrane is measured";
}

TEST(Assessment, TheMiddleOfThePictureIsOnTheSheetOfTheLine) {
  FoldScene scene;
  scene.view.assessment.tracing = LineTracing::kView;
  Assessor assessor(scene.view);
  assessor.Begin(test::kStart_ns);
  for (int i = 0; i < 100; ++i) {
    ToolState state = ToolAt(0.03 * i, Vec3d::Zero(), Vec3d::Zero());
    state.tools[2].kind = ToolKind::kScope;
    state.tools[2].p_WT = Vec3f(0, 1e-5f * static_cast<float>(i), 0.1f);  // Above the middle of both sheets.
    state.tools[2].q_WT = Quatf::FromTwoVectors(Vec3f::UnitZ(), -state.tools[2].p_WT);
    assessor.Add(state);
  }
  assessor.Finish();
  EXPECT_LT(ValueOf(assessor, Measure::kDeviationMax), 0.1) << "the fold's node is 77 mm away in the atlas";
}

// --------------------------------------------------------------------------------------------------- prompts

TEST(Prompts, SayWhatIsWrongWhileItIs) {
  Running run;
  EXPECT_EQ(run.assessor.PromptsAt(0), 0u);
  run.assessor.Add(PushAt(1, 12));
  EXPECT_EQ(run.assessor.PromptsAt(1.1), BitOf(Prompt::kForceTooHigh));
  EXPECT_EQ(run.assessor.PromptsAt(2), 0u);
  for (int i = 0; i < 40; ++i) AddTip(3 + 0.01 * i, Vec2f::Zero(), false, CauteryMode::kCoag, &run.assessor);
  EXPECT_EQ(run.assessor.PromptsAt(3.4), BitOf(Prompt::kPedalWithoutContact));
  // Current into an organ is no current into air.
  for (int i = 0; i < 40; ++i) {
    CauteryContact contact = test::TipAt(4 + 0.01 * i, Vec2f::Zero(), false);
    contact.on_solid = true;
    run.assessor.Add(contact);
  }
  EXPECT_EQ(run.assessor.PromptsAt(4.4), 0u);
  AddTip(5, Vec2f(0.03f, 0.04f), true, CauteryMode::kCut, &run.assessor);
  EXPECT_EQ(run.assessor.PromptsAt(5.1), BitOf(Prompt::kUreterNear) | BitOf(Prompt::kOffLine));
  AddTip(6, Vec2f(0.03f, 0.04f), true, CauteryMode::kOff, &run.assessor);
  EXPECT_EQ(run.assessor.PromptsAt(6.1), 0u) << "without current it may be touched";
  ThermalEvent event;
  event.session_time_s = 8;
  event.kind = ThermalEventKind::kSolidBurn;
  event.solid = 0;
  run.assessor.Add(event);
  EXPECT_EQ(run.assessor.PromptsAt(8.1), BitOf(Prompt::kOrganBurnt));
  event.kind = ThermalEventKind::kNerveInjury;
  run.assessor.Add(event);
  EXPECT_EQ(MostUrgent(run.assessor.PromptsAt(9)), "injury: stop");
}

TEST(Prompts, SayNerveOfANerve) {
  test::AssessedScene scene;
  scene.structures[0].kind = ProtectedKind::kNerve;
  Assessor assessor(scene.view);
  assessor.Begin(test::kStart_ns);
  AddTip(5, Vec2f(0.03f, 0.04f), true, CauteryMode::kCut, &assessor);
  EXPECT_EQ(assessor.PromptsAt(5.1), BitOf(Prompt::kNerveNear) | BitOf(Prompt::kOffLine));
  ThermalEvent event;
  event.session_time_s = 8;
  event.kind = ThermalEventKind::kNerveWarning;
  assessor.Add(event);
  EXPECT_EQ(assessor.PromptsAt(8.1), BitOf(Prompt::kNerveHot));
}

TEST(Prompts, TheMostUrgentIsSaid) {
  EXPECT_EQ(MostUrgent(0), "");
  EXPECT_EQ(MostUrgent(BitOf(Prompt::kOffLine) | BitOf(Prompt::kUreterHot)), "ureter is getting hot");
}

// ---------------------------------------------------------------------------------------------------- points

TEST(Points, FallInProportionToNoneAtTwiceTheThreshold) {
  EXPECT_EQ(Kept(3, 4, false), 1);
  EXPECT_EQ(Kept(6, 4, false), 0.5);
  EXPECT_EQ(Kept(9, 4, false), 0);
  EXPECT_EQ(Kept(1, 0, false), 0);
  EXPECT_EQ(Kept(0, 0, false), 1);
  EXPECT_EQ(Kept(90, 90, true), 1);
  EXPECT_NEAR(Kept(67.5, 90, true), 0.5, 1e-12);
  EXPECT_EQ(Kept(40, 90, true), 0);
  EXPECT_EQ(Kept(-2, -3, true), 1);
  EXPECT_NEAR(Kept(-4.5, -3, true), 0.5, 1e-12);
  EXPECT_EQ(Kept(-9, -3, true), 0);
  EXPECT_EQ(Kept(std::nan(""), 3, false), 0);
}

TEST(Points, WhoeverDoesNothingIsGivenNothing) {
  Running run;
  for (int i = 0; i < 5000; ++i) run.assessor.Add(ToolAt(1e-3 * i, Vec3d::Zero(), Vec3d::Zero()));
  run.assessor.Finish();
  const Score score = Evaluate(run.scene.view.assessment, run.assessor.figures());
  EXPECT_GT(score.of, 50);
  EXPECT_EQ(score.points, 0);
}

TEST(Points, AllThatIsKeptIsAllThereIs) {
  AssessmentParams params = UsualAssessment();
  Figures figures;
  for (std::size_t i = 0; i < kMeasureCount; ++i) figures.session[i] = static_cast<double>(params.limit[i]);
  const Score whole = Evaluate(params, figures);
  EXPECT_EQ(whole.points, whole.of);
  EXPECT_EQ(whole.percent(), 100);
  figures.session[static_cast<std::size_t>(Measure::kUreterInjuries)] = 1;
  const Score hurt = Evaluate(params, figures);
  EXPECT_EQ(hurt.of - hurt.points, 15);
  const auto item = std::find_if(hurt.items.begin(), hurt.items.end(),
                                 [](const ScoreItem& i) { return i.measure == Measure::kUreterInjuries; });
  ASSERT_NE(item, hurt.items.end());
  EXPECT_FALSE(item->passed);
}

TEST(Measures, UsualThresholdsAreValidAndNamesDiffer) {
  std::set<std::string> names, keys;
  for (const MeasureInfo& info : kMeasures) {
    EXPECT_GE(info.limit, info.low) << info.key;
    EXPECT_LE(info.limit, info.high) << info.key;
    EXPECT_EQ(std::string(info.key).substr(0, std::string(info.name).size()), info.name);
    EXPECT_LE(std::string(info.key).size(), 31u);
    names.insert(info.name);
    keys.insert(info.key);
  }
  EXPECT_EQ(names.size(), kMeasureCount);
  EXPECT_EQ(keys.size(), kMeasureCount);
}

}  // namespace
}  // namespace fulcrum::assessment
