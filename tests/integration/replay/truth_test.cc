// The ground truth of a picture against OpenGL, which draws the depth and the number of each surface as colours, and
// against itself a moment later.
#include "services/apps/replayer/truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <osg/Geode>
#include <osg/Geometry>
#include <osg/NodeVisitor>
#include <osg/Program>
#include <regex>
#include <set>
#include <string>

#include "render_node/scene_graph/display.h"
#include "services/apps/replayer/coco.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::replay {
namespace {

using render::Hit;
using render::LaparoscopeView;

TruthClass ClassNamed(const std::string& name) {
  if (name == "rectum") return TruthClass::kRectum;
  if (name == "fat") return TruthClass::kFat;
  if (name == "membrane" || name == "cut") return TruthClass::kMembrane;
  if (name == "surroundings" || name == "breathing") return TruthClass::kSurroundings;
  return name == "mask" ? TruthClass::kNone : TruthClass::kGrasper;  // Any instrument.
}

/// Makes all programs draw depth [m] in red and green and the class in blue, and removes the effects.
class DrawTruth final : public osg::NodeVisitor {
 public:
  DrawTruth() : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN) {}
  void apply(osg::Geode& geode) override {
    for (unsigned k = geode.getNumDrawables(); k-- > 0;) {
      const std::string name = geode.getDrawable(k)->getName();
      if (name == "smoke" || name == "shadow" || name == "fat beneath") {  // The last is never counted as fat.
        geode.removeDrawables(k);
      } else if (name != "field" && name != "overlay" && geode.getDrawable(k)->getStateSet() != nullptr) {
        Change(geode.getDrawable(k)->getStateSet(), name);
      }
    }
  }
  void apply(osg::Group& group) override {
    // The instruments have one program at their root.
    if (group.getStateSet() != nullptr) Change(group.getStateSet(), "instrument");
    traverse(group);
  }

 private:
  void Change(osg::StateSet* state, const std::string& name) {
    auto* program = dynamic_cast<osg::Program*>(state->getAttribute(osg::StateAttribute::PROGRAM));
    if (program == nullptr || name == "mask" || !changed_.insert(program).second) return;
    state->setMode(GL_BLEND, osg::StateAttribute::OFF);
    for (unsigned s = 0; s < program->getNumShaders(); ++s) {
      osg::Shader* shader = program->getShader(s);
      if (shader->getType() != osg::Shader::FRAGMENT) continue;
      std::string text = shader->getShaderSource();
      const std::regex either_layer(R"(max\(heat\.a, heat_below\.a\) < 0\.5)");
      EXPECT_EQ(std::regex_search(text, either_layer), name == "membrane") << name;
      text = std::regex_replace(text, either_layer, "heat.a < 0.5");
      const std::string opened = name == "fat" ? "if (coordinate.w <= 0.5 && heat.a >= 0.5) discard;" : "";
      const std::string number = std::to_string(static_cast<int>(ClassNamed(name)));
      const std::size_t last = text.rfind("fragment = ");
      ASSERT_NE(last, std::string::npos) << name;
      text.replace(last, text.find(';', last) + 1 - last,
                   opened +
                       "float distance_m = clamp(-position.z, 0.0, 1.0) * 255.0;"
                       "fragment = vec4(floor(distance_m) / 255.0, fract(distance_m), " +
                       number + ".0 / 255.0, 1.0);");
      shader->setShaderSource(text);
    }
  }
  std::set<osg::Program*> changed_;
};

/// Whether the depth changes by more than a millimetre from this pixel to the next.
bool AtAnEdge(const Truth& truth, int x, int y) {
  const float here = truth.raster().At(x, y).depth_m;
  const auto far = [&](int column, int row) { return std::abs(truth.raster().At(column, row).depth_m - here) > 1e-3f; };
  return far(std::max(0, x - 1), y) || far(std::min(truth.camera().width - 1, x + 1), y) ||
         far(x, std::max(0, y - 1)) || far(x, std::min(truth.camera().height - 1, y + 1));
}

/// Number of a class in DrawTruth, which knows one for all instruments.
std::size_t NumberOf(TruthClass what) { return static_cast<std::size_t>(IsTool(what) ? TruthClass::kGrasper : what); }

constexpr int kFiner = 4;  // Times the lines.

/// Intersection over union of each class.
class Overlap {
 public:
  void Add(TruthClass what, std::size_t drawn) {
    const std::size_t mine = NumberOf(what);
    if (mine == drawn) ++both_.at(mine);
    ++either_.at(mine);
    if (mine != drawn) ++either_.at(drawn);
  }
  [[nodiscard]] double Of(TruthClass what) const { return both_[NumberOf(what)] / either_[NumberOf(what)]; }
  void Expect(const char* lines) const {
    for (const TruthClass what : {TruthClass::kNone, TruthClass::kSurroundings, TruthClass::kFat, TruthClass::kMembrane,
                                  TruthClass::kGrasper}) {
      const std::size_t k = NumberOf(what);
      EXPECT_GT(either_[k], 100) << NameOf(what) << " is in the picture";
      std::printf("mask_iou %s %s %.4f\n", lines, NameOf(what), Of(what));
      EXPECT_GE(Of(what), 0.98) << lines << " " << NameOf(what);
    }
  }

 private:
  std::array<double, kTruthClasses> both_{}, either_{};
};

class TruthTest : public ::testing::Test {
 protected:
  TruthTest() : data_(scene::BuildProcedural(scene::BuiltIn())), scene_(data_.View()) { SetLines(270); }
  void SetLines(std::uint32_t lines) {
    scene_.render.width = lines * 16 / 9;
    scene_.render.height = lines;
    laparoscope_.emplace(scene_);
    laparoscope_->SetDetail(kTruthDetail);
  }
  /// What OpenGL draws of the present moment, by DrawTruth. Changes the programs for good.
  render::Bitmap DrawnTruth() {
    DrawTruth change;
    laparoscope_->root()->accept(change);
    const auto display = render::MakeOffscreenDisplay(*laparoscope_, scene_.render);
    render::Bitmap drawn;
    display->DrawAndRead(&drawn);
    return drawn;
  }
  void Show(double time_s) {
    const render::SyntheticMoment moment = render::MakeSyntheticMoment(scene_, time_s);
    laparoscope_->SetTissue(moment.tissue.xyz);
    laparoscope_->SetTopology(moment.topology);
    for (const TemperaturePatch& patch : moment.patches) laparoscope_->ApplyPatch(patch);
    for (int tool = 0; tool < kMaxTools; ++tool) {
      const auto k = static_cast<std::size_t>(tool);
      laparoscope_->SetTool(tool, moment.tools.tools[k]);
      laparoscope_->SetJaw(tool, moment.handles.handles[k].jaw_angle_rad);
    }
    laparoscope_->Update();
  }
  /// Gives all texels of the solids this value; shown after the next Update().
  void BurnSolids(const std::array<std::uint8_t, 4>& texel) {
    TemperaturePatch patch;
    patch.header.surface = BurntSurface::kSolids;
    for (int k = 0; k < kPatchTexels * kPatchTexels; ++k) {
      patch.texels.insert(patch.texels.end(), texel.begin(), texel.end());
    }
    for (int y = 0; y < kAtlasTexels; y += kPatchTexels) {
      for (int x = 0; x < kAtlasTexels; x += kPatchTexels) {
        patch.header.origin_x = static_cast<std::uint32_t>(x);
        patch.header.origin_y = static_cast<std::uint32_t>(y);
        (void)laparoscope_->ApplyPatch(patch);  // Most lie outside the atlas.
      }
    }
  }
  /// @param finer times as many lines as the picture.
  Truth TruthNow(int finer = 1) {
    return Truth({&*laparoscope_, laparoscope_->laparoscope(), scene_, finer * static_cast<int>(scene_.render.width),
                  finer * static_cast<int>(scene_.render.height)});
  }

  /// Masks and depth of the present moment against what OpenGL draws.
  void ExpectAsDrawn() {
    const Truth truth = TruthNow();
    const render::Bitmap drawn = DrawnTruth();
    Overlap overlap;
    double worst_m = 0;
    for (int y = 0; y < drawn.height; ++y) {
      for (int x = 0; x < drawn.width; ++x) {
        const Hit& hit = truth.raster().At(x, y);
        const std::uint8_t* pixel =
            &drawn.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(drawn.width) +
                            static_cast<std::size_t>(x))];
        overlap.Add(truth.ClassOf(hit), pixel[2]);
        const double depth_m = (pixel[0] + pixel[1] / 255.0) / 255;
        if (NumberOf(truth.ClassOf(hit)) != pixel[2] || !hit.any() || AtAnEdge(truth, x, y)) continue;
        worst_m = std::max(worst_m, std::abs(depth_m - static_cast<double>(hit.depth_m)));
      }
    }
    overlap.Expect("same");
    std::printf("depth_error_mm_max %.4f\n", 1e3 * worst_m);
    EXPECT_LT(worst_m, 1e-4);
  }

  scene::SceneData data_;
  SceneView scene_;
  std::optional<LaparoscopeView> laparoscope_;
};

TEST_F(TruthTest, IsWhatOpenGLDraws) {
  Show(14);  // The tent is lifted, the slit is open, both instruments are in the field.
  ExpectAsDrawn();
}

TEST_F(TruthTest, IsWhatOpenGLDrawsOfThePaperAsPrintedToo) {
  scene_.thermal.model = ThermalModel::kPaper;
  scene_.thermal.as = PaperForm::kPrinted;
  SetLines(270);
  Show(14);
  ExpectAsDrawn();
}

/// Class that most of the 16 pixels of a picture of four times the lines have; none where two have as many.
template <class ClassAt>
std::optional<std::size_t> Majority(int x, int y, const ClassAt& class_at) {
  std::array<int, kTruthClasses> votes{};
  for (int k = 0; k < kFiner * kFiner; ++k) ++votes.at(class_at(kFiner * x + k % kFiner, kFiner * y + k / kFiner));
  const auto most = std::max_element(votes.begin(), votes.end());
  if (std::count(votes.begin(), votes.end(), *most) > 1) return std::nullopt;
  return static_cast<std::size_t>(most - votes.begin());
}

TEST_F(TruthTest, MasksAreThoseOfFourTimesTheLines) {
  constexpr int kLines = 540;
  SetLines(kFiner * kLines);
  Show(14);
  const auto with_lines = [&](int lines) {
    return Truth({&*laparoscope_, laparoscope_->laparoscope(), scene_, lines * 16 / 9, lines});
  };
  const Truth truth = with_lines(kLines), fine = with_lines(kFiner * kLines);
  const render::Bitmap drawn = DrawnTruth();
  const auto drawn_at = [&](int x, int y) {
    return std::size_t{drawn.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(drawn.width) +
                                      static_cast<std::size_t>(x)) +
                                 2]};
  };
  const auto fine_at = [&](int x, int y) { return NumberOf(fine.ClassOf(fine.raster().At(x, y))); };
  Overlap masks, rule, limit;
  for (int y = 0; y < truth.camera().height; ++y) {
    for (int x = 0; x < truth.camera().width; ++x) {
      const Hit& hit = truth.raster().At(x, y);
      const auto by_drawn = Majority(x, y, drawn_at), by_rule = Majority(x, y, fine_at);
      if (by_drawn) masks.Add(truth.ClassOf(hit), *by_drawn);
      if (by_rule) limit.Add(truth.ClassOf(hit), *by_rule);
      if (by_drawn && by_rule) rule.Add(static_cast<TruthClass>(*by_rule), *by_drawn);
    }
  }
  rule.Expect("finer_same_samples");
  // The class at a pixel's centre and that of its larger part differ at the ends and bends of a border: of a strip ten
  // pixels wide with strands across it, as bared fat is, this is 1.5 %. No rule that looks at the centre can reach
  // more.
  limit.Expect("finer_limit_of_centres");
  masks.Expect("finer");
}

TEST_F(TruthTest, APixelIsWhereItsPointIs) {
  Show(14);
  const Truth truth = TruthNow();
  for (int y = 0; y < truth.camera().height; y += 3) {
    for (int x = 0; x < truth.camera().width; x += 3) {
      const Hit& hit = truth.raster().At(x, y);
      if (!hit.any()) continue;
      const auto [place, depth] = truth.PlaceOf(truth.PointOf(hit));
      EXPECT_NEAR(place.x(), x + 0.5, 1e-3);
      EXPECT_NEAR(place.y(), y + 0.5, 1e-3);
      EXPECT_NEAR(depth, static_cast<double>(hit.depth_m), 1e-6);
    }
  }
}

/// Material coordinates at a place between pixels; none beside the sheet.
std::optional<Vec2d> MaterialAt(const Truth& truth, const Vec2d& place) {
  const double x = place.x() - 0.5, y = place.y() - 0.5;
  const int left = static_cast<int>(std::floor(x)), low = static_cast<int>(std::floor(y));
  Vec2d mean = Vec2d::Zero();
  for (int k = 0; k < 4; ++k) {
    const int column = left + k % 2, row = low + k / 2;
    const auto material = truth.MaterialOf(truth.raster().At(column, row));
    if (!material || truth.ClassOf(truth.raster().At(column, row)) != TruthClass::kMembrane) return std::nullopt;
    mean += (1 - std::abs(x - column)) * (1 - std::abs(y - row)) * *material;
  }
  return mean;
}

TEST_F(TruthTest, FlowLeadsToTheSameTissue) {
  Show(5);
  const Truth before = TruthNow();
  Show(5.2);
  // Finer, because the sheet's coordinates are read between pixels, where it is bent.
  const Truth after = TruthNow(), fine = TruthNow(kFiner);
  Channel flow = before.FlowTo(after);
  int compared = 0;
  double moved = 0, worst_px = 0;
  for (int y = 1; y + 1 < flow.height; ++y) {
    for (int x = 1; x + 1 < flow.width; ++x) {
      const Vec2d here(x + 0.5, flow.height - y - 0.5);  // From the lower left.
      if (flow.At(x, y, 2) != static_cast<int>(FlowState::kVisible)) continue;
      const Vec2d step(kFlowUnit_px * (flow.At(x, y, 0) - 32768.0), -kFlowUnit_px * (flow.At(x, y, 1) - 32768.0));
      const auto from = MaterialAt(before, here);
      const Vec2d there = here + step;
      if (!from || there.x() < 2 || there.y() < 2 || there.x() > flow.width - 2 || there.y() > flow.height - 2)
        continue;
      const auto at = [&](double right, double up) { return MaterialAt(fine, kFiner * (there + Vec2d(right, up))); };
      const auto to = at(0, 0), right = at(1, 0), up = at(0, 1);
      if (!to || !right || !up) continue;
      Eigen::Matrix2d pixel;
      pixel << *right - *to, *up - *to;
      const double error_px = (pixel.inverse() * (*to - *from)).norm();
      // Where the sheet is bent within a pixel or seen from the side its material is not linear between pixels.
      const double size = std::sqrt(std::abs(pixel.determinant()));
      if (pixel.col(0).norm() > 2 * size || pixel.col(1).norm() > 2 * size) continue;
      worst_px = std::max(worst_px, error_px);
      moved = std::max(moved, step.norm());
      ++compared;
    }
  }
  EXPECT_GT(compared, 5000);
  EXPECT_GT(moved, 1) << "something moves";
  std::printf("flow_error_px_max %.4f of %d pixels\n", worst_px, compared);
  EXPECT_LT(worst_px, 0.1);
}

/// Pixel to which the flow leads, from the upper left.
std::pair<int, int> PixelAfter(Channel* flow, int x, int y) {
  const auto moved = [&](int from, int sample) {
    return static_cast<int>(std::floor(from + 0.5 + kFlowUnit_px * (flow->At(x, y, sample) - 32768.0)));
  };
  return {moved(x, 0), moved(y, 1)};
}

TEST_F(TruthTest, OfTissueThatIsCutMeanwhileThereIsNoFlow) {
  Show(8);
  const Truth before = TruthNow();
  Show(14);
  const Truth after = TruthNow();
  Channel flow = before.FlowTo(after), classes = after.Classes();
  int none = 0;
  for (int y = 0; y < flow.height; ++y) {
    for (int x = 0; x < flow.width; ++x) {
      const Hit& hit = before.raster().At(x, flow.height - 1 - y);
      if (before.ClassOf(hit) != TruthClass::kMembrane) continue;
      const auto state = static_cast<FlowState>(flow.At(x, y, 2));
      none += state == FlowState::kNone ? 1 : 0;
      if (state == FlowState::kNone) {
        EXPECT_EQ(flow.At(x, y, 0), 0);
      }
      if (state != FlowState::kVisible) continue;
      const auto [u, v] = PixelAfter(&flow, x, y);
      ASSERT_TRUE(u >= 0 && v >= 0 && u < flow.width && v < flow.height);
      EXPECT_EQ(classes.At(u, v), static_cast<int>(TruthClass::kMembrane)) << x << " " << y;
    }
  }
  EXPECT_GT(none, 30) << "the slit has become longer";
}

TEST_F(TruthTest, WhatAnInstrumentCoversNextIsHidden) {
  Show(6);
  const Truth before = TruthNow();
  Show(8);
  const Truth after = TruthNow();
  Channel flow = before.FlowTo(after), classes = after.Classes();
  int hidden = 0, wrong = 0;
  for (int y = 0; y < flow.height; ++y) {
    for (int x = 0; x < flow.width; ++x) {
      if (flow.At(x, y, 2) != static_cast<int>(FlowState::kHidden)) continue;
      ++hidden;
      const auto [u, v] = PixelAfter(&flow, x, y);
      if (u < 0 || v < 0 || u >= flow.width || v >= flow.height || classes.At(u, v) == 0) continue;
      const auto what = static_cast<TruthClass>(classes.At(u, v));
      wrong += !IsTool(what) && what == before.ClassOf(before.raster().At(x, flow.height - 1 - y)) ? 1 : 0;
    }
  }
  EXPECT_GT(hidden, 200);
  EXPECT_LT(wrong, hidden / 10) << "hidden behind itself: the tent's far side only";
}

TEST_F(TruthTest, HeatIsThatOfTheSheet) {
  Show(14);
  const Truth truth = TruthNow();
  Channel temperature = truth.temperature(), damage = truth.damage(), classes = truth.Classes();
  int cold = 0, burnt = 0;
  for (int y = 0; y < classes.height; ++y) {
    for (int x = 0; x < classes.width; ++x) {
      const auto what = static_cast<TruthClass>(classes.At(x, y));
      const bool sheet = what == TruthClass::kMembrane || what == TruthClass::kFat;
      EXPECT_EQ(temperature.At(x, y) != 0, sheet) << x << " " << y;
      cold += sheet && damage.At(x, y) == 0 && std::abs(temperature.At(x, y) * kTemperatureUnit_C - 37) < 0.3 ? 1 : 0;
      burnt += damage.At(x, y) > 128 ? 1 : 0;
    }
  }
  EXPECT_GT(cold, 5000);
  EXPECT_GT(burnt, 20);
}

TEST_F(TruthTest, HeatOfASolidIsThatOfItsBurntCharts) {
  // The sheet is moved aside: half of the rectum in the field is bared, beside what is still covered.
  constexpr float kAside_m = 0.03f;
  std::vector<float> xyz;
  for (std::size_t i = 0; i < scene_.rest_position.size(); ++i) {
    const Vec3f& p_W = scene_.rest_position[i];
    const float aside = i >= scene_.membrane.first ? kAside_m : 0;
    xyz.insert(xyz.end(), {p_W.x() + aside, p_W.y(), p_W.z()});
  }
  laparoscope_->SetTissue(xyz);
  laparoscope_->Update();
  const Truth cold = TruthNow();
  BurnSolids({120, 200, 60, 255});
  laparoscope_->Update();
  const Truth burnt = TruthNow();

  Channel classes = burnt.Classes();
  EXPECT_EQ(cold.Classes().values, classes.values) << "nothing opens";
  Channel before = cold.temperature(), temperature = burnt.temperature();
  Channel damage_before = cold.damage(), damage = burnt.damage(), water_before = cold.water(), water = burnt.water();
  int rectum = 0, membrane = 0, known = 0;
  for (int y = 0; y < classes.height; ++y) {
    for (int x = 0; x < classes.width; ++x) {
      const auto what = static_cast<TruthClass>(classes.At(x, y));
      membrane += what == TruthClass::kMembrane ? 1 : 0;
      rectum += what == TruthClass::kRectum ? 1 : 0;
      if (what != TruthClass::kRectum) {
        EXPECT_EQ(temperature.At(x, y), before.At(x, y)) << x << " " << y;
        EXPECT_EQ(damage.At(x, y), damage_before.At(x, y));
        EXPECT_EQ(water.At(x, y), water_before.At(x, y));
        continue;
      }
      EXPECT_EQ(before.At(x, y), 0);
      EXPECT_EQ(damage_before.At(x, y), 0);
      if (temperature.At(x, y) == 0) continue;
      ++known;
      EXPECT_EQ(temperature.At(x, y), 8000);
      EXPECT_EQ(damage.At(x, y), 200);
      EXPECT_EQ(water.At(x, y), 255 - 2 * 60);
    }
  }
  EXPECT_GT(rectum, 1000);
  EXPECT_GT(membrane, 1000);
  EXPECT_GT(known, 0.9 * rectum) << "all charts are burnt";
}

TEST(InstanceMasks, HaveBoxAreaAndRunsColumnByColumnFromZero) {
  Channel image(3, 2, 8, 1);
  image.At(0, 0) = image.At(0, 1) = image.At(1, 0) = 7;
  image.At(2, 1) = 3;
  const std::map<int, InstanceMask> masks = InstanceMasks(image);
  ASSERT_EQ(masks.size(), 2u);
  const InstanceMask &seven = masks.at(7), &three = masks.at(3);
  EXPECT_EQ(seven.runs, (std::vector<std::uint32_t>{0, 3, 3}));
  EXPECT_EQ(three.runs, (std::vector<std::uint32_t>{5, 1}));
  EXPECT_EQ(seven.area, 3u);
  EXPECT_EQ((std::array{seven.left, seven.top, seven.right, seven.bottom}), (std::array{0, 0, 2, 2}));
  EXPECT_EQ((std::array{three.left, three.top, three.right, three.bottom}), (std::array{2, 1, 3, 2}));
}

}  // namespace
}  // namespace fulcrum::replay
