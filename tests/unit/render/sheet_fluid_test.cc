// Liquid on the sheet against known answers: level of a pool, flow of a film, conservation, tube, clot.
#include "render_node/geometry/sheet_fluid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "services/scene/builder/build.h"

namespace fulcrum::render {
namespace {

constexpr double kMm3 = 1e-9;
constexpr int kASecond = 50;  // Steps.

class SheetFluidTest : public testing::Test {
 protected:
  SheetFluidTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()), membrane_(view_) {
    const std::uint32_t node = view_.membrane.rows / 2 * view_.membrane.cols + view_.membrane.cols / 2;
    middle_ = view_.membrane_material[node];
    Shape([](const Vec2f&) { return 0.0f; });
  }

  /// Gives the sheet the height `z` over its own plane, from the middle.
  void Shape(const std::function<float(const Vec2f&)>& z) {
    std::vector<float> xyz(3 * view_.rest_position.size(), 0.0f);
    for (Index node = 0; node < view_.membrane.node_count(); ++node) {
      const Vec2f p = view_.membrane_material[node] - middle_;
      Eigen::Map<Vec3f>(xyz.data() + 3 * (std::size_t{view_.membrane.first} + node)) = Vec3f(p.x(), p.y(), z(p));
    }
    membrane_.Update(xyz);
  }

  void Run(SheetFluid* fluid, int steps, std::span<const WorkingTube> tubes = {}) {
    fluid->SetShape(membrane_);
    for (int k = 0; k < steps; ++k) fluid->Step(tubes);
  }
  /// Bleeds for so long in the middle.
  void Pour(SheetFluid* fluid, double mm3, int steps) {
    fluid->SetShape(membrane_);
    for (int k = 0; k < steps; ++k) {
      poured_m3_ += fluid->Bleed(middle_, kMm3 * mm3 / steps);
      fluid->Step({});
    }
  }
  WorkingTube Tube(TubeFlow flow, float away_m) const { return {flow, Vec3f(0, 0, away_m), -Vec3f::UnitZ(), 0.0025f}; }

  void ExpectConserved(const SheetFluid& fluid) { EXPECT_NEAR(fluid.blood().sum(), poured_m3_, 1e-4 * poured_m3_); }

  const scene::SceneData data_;
  const SceneView view_;
  MembraneMesh membrane_;
  Vec2f middle_;
  double poured_m3_ = 0;
};

TEST_F(SheetFluidTest, APoolInABowlIsLevelAndAsDeepAsItsVolumeSays) {
  constexpr float kCurvature = 10;  // z = k r^2 [1/m]
  Shape([](const Vec2f& p) { return kCurvature * p.squaredNorm(); });
  SheetFluid fluid(view_, {});
  Pour(&fluid, 150, 8 * kASecond);
  Run(&fluid, 60 * kASecond);
  EXPECT_FALSE(fluid.flows()) << "it comes to rest";
  // V = pi H^2 / (2 k) for the depth H in the middle.
  const double depth = std::sqrt(2 * kCurvature * 150 * kMm3 / std::numbers::pi);
  const auto level = [&](float x, float y) {
    const Vec2f p(x, y);
    return fluid.At(middle_ + p).liquid() + kCurvature * p.squaredNorm();
  };
  for (const float x : {-0.005f, -0.0025f, 0.0f, 0.003f, 0.006f}) {
    for (const float y : {-0.004f, 0.0f, 0.005f}) EXPECT_NEAR(level(x, y), depth, 0.12 * depth) << x << ' ' << y;
  }
  EXPECT_EQ(fluid.At(middle_ + Vec2f(0.013f, 0)).liquid(), 0) << "beyond the edge of the pool";
  ExpectConserved(fluid);
}

TEST_F(SheetFluidTest, APoolLevelsAgainHoweverSlowlyItsBowlTilts) {
  constexpr float kCurvature = 10, kTilt = 0.1f;  // The bowl's lowest place moves by 5 mm.
  const auto tilted = [](float share) {
    return [share](const Vec2f& p) { return kCurvature * p.squaredNorm() + share * kTilt * p.x(); };
  };
  const double depth = std::sqrt(2 * static_cast<double>(kCurvature) * 150 * kMm3 / std::numbers::pi);
  for (const int steps : {1, 500}) {  // 500: a cell moves by 2 um at most in each.
    Shape(tilted(0));
    SheetFluid fluid(view_, {});
    Pour(&fluid, 150, 8 * kASecond);
    Run(&fluid, 60 * kASecond);
    ASSERT_FALSE(fluid.flows());
    for (int k = 1; k <= steps; ++k) {
      Shape(tilted(static_cast<float>(k) / static_cast<float>(steps)));
      Run(&fluid, 1);
    }
    Run(&fluid, 60 * kASecond);
    EXPECT_FALSE(fluid.flows()) << steps;
    const float lowest = -kTilt * kTilt / (4 * kCurvature);
    for (const float x : {-0.010f, -0.0075f, -0.005f, -0.0025f, 0.0f}) {
      const Vec2f p(x, 0);
      EXPECT_NEAR(fluid.At(middle_ + p).liquid() + tilted(1)(p) - lowest, depth, 0.15 * depth) << steps << ' ' << x;
    }
    EXPECT_LT(fluid.At(middle_ + Vec2f(0.007f, 0)).liquid(), 0.15 * depth) << steps << ": has run off the upper side";
  }
}

TEST_F(SheetFluidTest, AFilmOnASlopeFlowsAsNusseltsDoes) {
  constexpr float kSlope = 1, kFilm_m = 1.5e-4f, kWets_m = 5e-5f;
  Shape([](const Vec2f& p) { return -kSlope * p.y(); });  // The far end of the rows is free.
  SheetFluid fluid(view_, {});
  fluid.SetShape(membrane_);
  const auto cell = static_cast<double>(4 * view_.membrane.texel_m);
  double widest = 0;
  for (float t = 0; t < 0.1f; t += 4 * view_.membrane.texel_m) {
    double width = 0;
    for (float s = 0; s < 0.06f; s += 4 * view_.membrane.texel_m) {
      const Vec2f place(s + 1e-4f, t + 1e-4f);
      const double added = fluid.Bleed(place, static_cast<double>(kFilm_m) * cell * cell);
      poured_m3_ += added;
      width += added > 0 ? cell : 0;
    }
    widest = std::max(widest, width);
  }
  for (int k = 0; k < kASecond / 2; ++k) fluid.Step({});
  const double before = fluid.blood().ran_off;
  for (int k = 0; k < kASecond; ++k) fluid.Step({});
  const double m = static_cast<double>(kFilm_m - kWets_m);
  const double flow = 9.81 * m * m * m * static_cast<double>(kSlope) / (3 * 3.3e-6) * widest;
  EXPECT_NEAR(fluid.blood().ran_off - before, flow * 1.0, 0.2 * flow);
  ExpectConserved(fluid);
}

TEST_F(SheetFluidTest, RunsIntoASlitAndOverItsOtherLipOnlyWhenItIsFull) {
  Shape([](const Vec2f& p) { return -0.3f * p.y(); });
  // A slit across the way down, 2 mm wide, from 5 mm below the source on.
  Atlas atlas(view_);
  TemperaturePatch patch;
  patch.header.origin_x = static_cast<std::uint32_t>(std::max(0.0f, middle_.x() - 0.0128f) / atlas.texel_m());
  patch.header.origin_y = static_cast<std::uint32_t>((middle_.y() + 0.004f) / atlas.texel_m());
  patch.texels.assign(4u * kPatchTexels * kPatchTexels, 255);
  for (std::size_t y = 10; y < 30; ++y) {
    for (std::size_t x = 8; x < kPatchTexels - 8; ++x) patch.texels[4 * (y * kPatchTexels + x) + 3] = 0;
  }
  ASSERT_FALSE(atlas.Apply(patch).empty());
  const auto lies = [&](const SheetFluid& fluid, float from_m, float to_m) {
    double sum = 0;
    const float cell = 4 * atlas.texel_m();
    for (float t = from_m; t < to_m; t += cell) {
      for (float s = -0.015f; s < 0.015f; s += cell) {
        sum += static_cast<double>(fluid.At(middle_ + Vec2f(s, t)).liquid() * cell * cell);
      }
    }
    return sum;
  };
  SheetFluid cut(view_, {}), whole(view_, {});
  for (SheetFluid* fluid : {&cut, &whole}) {
    const Atlas* shown = fluid == &cut ? &atlas : nullptr;
    fluid->SetShape(membrane_, shown);
    poured_m3_ = 0;
    for (int k = 0; k < 4 * kASecond; ++k) {
      poured_m3_ += fluid->Bleed(middle_, kMm3 * 12 / (4 * kASecond));
      fluid->Step({});
    }
    for (int k = 0; k < 4 * kASecond; ++k) fluid->Step({});
    ExpectConserved(*fluid);
  }
  const double beyond = lies(whole, 0.0075f, 0.02f);
  ASSERT_GT(beyond, 1 * kMm3) << "an uncut sheet lets it run past the place of the slit";
  EXPECT_LT(lies(cut, 0.0075f, 0.02f), 0.05 * beyond);
  EXPECT_GT(lies(cut, 0.0045f, 0.0075f), lies(whole, 0.0045f, 0.0075f));
}

TEST_F(SheetFluidTest, ASideThatTissueContinuesHoldsItBack) {
  Shape([](const Vec2f& p) { return -0.6f * p.x(); });
  const std::vector<float> rim(view_.membrane.node_count(), 1.0f);
  SheetFluid held(view_, rim), free(view_, {});
  for (SheetFluid* fluid : {&held, &free}) {
    Pour(fluid, 200, 4 * kASecond);
    Run(fluid, 20 * kASecond);
  }
  EXPECT_EQ(held.blood().ran_off, 0);
  EXPECT_GT(free.blood().ran_off, 50 * kMm3);
  const auto deepest = [&](const SheetFluid& fluid) {
    float depth = 0;
    for (float s = 0; s < 0.06f; s += 2e-4f) depth = std::max(depth, fluid.At(Vec2f(s, middle_.y())).liquid());
    return depth;
  };
  EXPECT_GT(deepest(held), 3 * deepest(free)) << "it gathers along the side";
}

TEST_F(SheetFluidTest, SuctionTakesWhatIsNearAndNothingFromFar) {
  SheetFluid fluid(view_, {});
  Pour(&fluid, 60, 3 * kASecond);
  const double before = fluid.blood().liquid;
  const WorkingTube far = Tube(TubeFlow::kAspirates, 0.010f), near = Tube(TubeFlow::kAspirates, 0.001f);
  Run(&fluid, kASecond, {&far, 1});
  EXPECT_EQ(fluid.blood().aspirated, 0);
  Run(&fluid, 3 * kASecond, {&near, 1});
  EXPECT_GT(fluid.blood().aspirated, 0.5 * before);
  EXPECT_LT(fluid.At(middle_).liquid(), 1e-5f);
  ExpectConserved(fluid);
}

TEST_F(SheetFluidTest, BloodClotsAndAClotIsHardToRemove) {
  SheetFluid fluid(view_, {});
  Pour(&fluid, 40, 3 * kASecond);
  Run(&fluid, 30 * kASecond);
  for (int k = 0; k < 45; ++k) fluid.Age(2);  // One time constant.
  const auto half = fluid.blood();
  EXPECT_NEAR(half.clotted / (half.clotted + half.liquid), 1 - std::exp(-1.0), 0.02);
  for (int k = 0; k < 400; ++k) fluid.Age(2);
  EXPECT_EQ(fluid.blood().liquid, 0);
  EXPECT_FALSE(fluid.ages());
  const double clot = fluid.blood().clotted;
  const WorkingTube suction = Tube(TubeFlow::kAspirates, 0.0005f), jet = Tube(TubeFlow::kIrrigates, 0.008f);
  Run(&fluid, 2 * kASecond, {&suction, 1});
  EXPECT_GT(fluid.blood().clotted, 0.6 * clot);
  const double left = fluid.At(middle_).clot;
  Run(&fluid, 2 * kASecond, {&jet, 1});
  EXPECT_NEAR(fluid.At(middle_).clot, left * std::exp(-2.0 / 6), 0.1 * left) << "slowly";
  ExpectConserved(fluid);
}

TEST_F(SheetFluidTest, IrrigationThinsBloodAndWashesItOff) {
  Shape([](const Vec2f& p) { return -0.5f * p.x(); });
  SheetFluid fluid(view_, {});
  Pour(&fluid, 40, 3 * kASecond);
  const float before = fluid.At(middle_).blood;
  const WorkingTube jet = Tube(TubeFlow::kIrrigates, 0.010f);
  Run(&fluid, 2 * kASecond, {&jet, 1});
  EXPECT_GT(fluid.At(middle_).water, 3e-4f);
  EXPECT_LT(fluid.At(middle_).blood, 0.05f * before);
  EXPECT_GT(fluid.At(middle_ + Vec2f(0.010f, 0)).water, 5e-5f) << "it runs down";
  Run(&fluid, 10 * kASecond);
  for (int k = 0; k < 100; ++k) fluid.Age(2);
  EXPECT_LT(fluid.At(middle_).water, 1e-6f) << "the tissue dries";
  ExpectConserved(fluid);
}

TEST_F(SheetFluidTest, AJetBesideTheSheetWetsNothing) {
  SheetFluid fluid(view_, {});
  const WorkingTube away{TubeFlow::kIrrigates, Vec3f(0, 0, 0.01f), Vec3f::UnitZ(), 0.0025f};
  Run(&fluid, kASecond, {&away, 1});
  EXPECT_TRUE(fluid.dry());
  EXPECT_EQ(fluid.Bleed(Vec2f(-0.01f, 0.02f), kMm3), 0) << "beside the sheet";
}

TEST_F(SheetFluidTest, IsBoundedInANarrowHollow) {
  Shape([](const Vec2f& p) { return 4000 * p.squaredNorm(); });
  SheetFluid fluid(view_, {});
  Pour(&fluid, 3000, 4 * kASecond);
  EXPECT_LE(fluid.At(middle_).liquid(), 0.0061f);
  ExpectConserved(fluid);
}

TEST_F(SheetFluidTest, OneShowsAllThatChanged) {
  Atlas atlas(view_);
  SheetFluid fluid(view_, {});
  EXPECT_FALSE(fluid.Show(&atlas));
  Pour(&fluid, 20, kASecond);
  EXPECT_TRUE(fluid.Show(&atlas));
  EXPECT_NEAR(atlas.Blood(middle_), std::min(1.0f, fluid.At(middle_).blood / SheetFluid::kFullBlood_m), 0.15f);
  EXPECT_FALSE(fluid.Show(&atlas));
  const WorkingTube tube = Tube(TubeFlow::kAspirates, 0.0005f);
  Run(&fluid, 3 * kASecond, {&tube, 1});
  EXPECT_TRUE(fluid.Show(&atlas));
  EXPECT_LT(atlas.Blood(middle_), 0.02f);
}

}  // namespace
}  // namespace fulcrum::render
