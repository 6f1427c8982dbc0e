// Pictures of the built-in scene against pictures approved by a person, and proof that the comparison detects severe
// faults: a slit that is missing, an opaque membrane, a cut drawn as missing triangles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <osg/Geode>
#include <osg/Geometry>
#include <osg/NodeVisitor>
#include <osg/Program>
#include <string>
#include <utility>

#include "render_node/geometry/texel.h"
#include "render_node/node/hud.h"
#include "render_node/offscreen/png_writer.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/synthetic_clips.h"

namespace fulcrum::render {
namespace {

// Rasterisers round edges differently, by a pixel: this changes the mean over blocks of 6 x 6 pixels by a few of 255.
// Faults that are obvious to the eye (the mutations below) exceed the limit in some block by more than three times.
constexpr int kBlock = 3;           // Block size in the reduced picture.
constexpr double kWorstBlock = 12;  // Of 255, per channel.
constexpr double kMean = 1.5;

/// Mean of each 2 x 2 pixels, as stored in the files.
Bitmap Reduced(const Bitmap& full) {
  Bitmap half{full.width / 2, full.height / 2, {}};
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        int sum = 2;
        for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
          sum += full.rgb[3 * TexelIndex(2 * x + dx, 2 * y + dy, full.width) + channel];
        }
        half.rgb.push_back(static_cast<std::uint8_t>(sum / 4));
      }
    }
  }
  return half;
}

struct Difference {
  double worst_block = 0, mean = 0;
  [[nodiscard]] bool visible() const { return worst_block > kWorstBlock || mean > kMean; }
};

Difference Compare(const Bitmap& a, const Bitmap& b) {
  Difference difference;
  if (a.width != b.width || a.height != b.height) {
    return {255, 255};
  }
  int blocks = 0;
  for (int y = 0; y + kBlock <= a.height; y += kBlock) {
    for (int x = 0; x + kBlock <= a.width; x += kBlock) {
      double worst = 0;
      for (std::size_t channel = 0; channel < 3; ++channel) {
        int sum = 0;
        for (int k = 0; k < kBlock * kBlock; ++k) {
          const std::size_t i = 3 * TexelIndex(x + k % kBlock, y + k / kBlock, a.width) + channel;
          sum += int{a.rgb[i]} - int{b.rgb[i]};
        }
        worst = std::max(worst, std::abs(sum) / static_cast<double>(kBlock * kBlock));
      }
      difference.worst_block = std::max(difference.worst_block, worst);
      difference.mean += worst;
      ++blocks;
    }
  }
  difference.mean /= blocks;
  return difference;
}

/// Replaces a line of the membrane's shader to draw with a fault.
class Rewrite : public osg::NodeVisitor {
 public:
  Rewrite(std::string before, std::string after)
      : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN), before_(std::move(before)), after_(std::move(after)) {}
  void apply(osg::Geode& geode) override {
    for (unsigned k = 0; k < geode.getNumDrawables(); ++k) {
      if (geode.getDrawable(k)->getName() != "membrane") {
        continue;
      }
      auto* program = static_cast<osg::Program*>(
          geode.getDrawable(k)->getOrCreateStateSet()->getAttribute(osg::StateAttribute::PROGRAM));
      for (unsigned s = 0; s < program->getNumShaders(); ++s) {
        std::string text = program->getShader(s)->getShaderSource();
        if (const std::size_t place = text.find(before_); place != std::string::npos) {
          program->getShader(s)->setShaderSource(text.replace(place, before_.size(), after_));
          ++found;
        }
      }
    }
  }
  int found = 0;

 private:
  std::string before_, after_;
};

/// Draws the untouched parts of the membrane by the shader of the touched ones.
class OneShader : public osg::NodeVisitor {
 public:
  OneShader() : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN) {}
  void apply(osg::Geode& geode) override {
    for (unsigned k = 0; k < geode.getNumDrawables(); ++k) {
      osg::Drawable* drawable = geode.getDrawable(k);
      if (drawable->getName() != "membrane") continue;
      if (found++ == 0) untouched_ = drawable->getStateSet();
      if (drawable->getStateSet() != untouched_) touched = drawable->getStateSet();
    }
    for (unsigned k = 0; touched && k < geode.getNumDrawables(); ++k) {
      if (geode.getDrawable(k)->getName() == "membrane") geode.getDrawable(k)->setStateSet(touched);
    }
  }
  int found = 0;
  osg::ref_ptr<osg::StateSet> touched;

 private:
  osg::StateSet* untouched_ = nullptr;
};

class Remove : public osg::NodeVisitor {
 public:
  explicit Remove(std::string name) : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN), name_(std::move(name)) {}
  void apply(osg::Geode& geode) override {
    for (unsigned k = geode.getNumDrawables(); k-- > 0;) {
      if (geode.getDrawable(k)->getName() == name_) {
        geode.removeDrawables(k);
        ++found;
      }
    }
  }
  int found = 0;

 private:
  std::string name_;
};

class ReverseTriangles : public osg::NodeVisitor {
 public:
  ReverseTriangles() : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN) {}
  void apply(osg::Geode& geode) override {
    for (unsigned k = 0; k < geode.getNumDrawables(); ++k) {
      if (geode.getDrawable(k)->getName() == "membrane") {
        auto* indices = static_cast<osg::DrawElementsUInt*>(geode.getDrawable(k)->asGeometry()->getPrimitiveSet(0));
        for (std::size_t i = 0; i + 3 <= indices->size() / 6 * 3; i += 3) {
          std::swap_ranges(indices->begin() + static_cast<std::ptrdiff_t>(i),
                           indices->begin() + static_cast<std::ptrdiff_t>(i + 3),
                           indices->end() - static_cast<std::ptrdiff_t>(i + 3));
        }
        indices->dirty();
        ++found;
      }
    }
  }
  int found = 0;
};

class Opaque : public osg::NodeVisitor {
 public:
  Opaque() : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN) {}
  void apply(osg::Geode& geode) override {
    for (unsigned k = 0; k < geode.getNumDrawables(); ++k) {
      if (geode.getDrawable(k)->getName() == "membrane") {
        geode.getDrawable(k)->getOrCreateStateSet()->setMode(GL_BLEND, osg::StateAttribute::OFF);
        ++found;
      }
    }
  }
  int found = 0;
};

class GoldenTest : public testing::Test {
 protected:
  GoldenTest() : data_(scene::BuildProcedural(scene::BuiltIn())), view_(data_.View()) {
    view_.render.width = 480;
    view_.render.height = 270;
  }

  Bitmap Draw(const SyntheticMoment& moment, const std::function<void(LaparoscopeView*)>& change = {}) const {
    LaparoscopeView laparoscope(view_);
    const auto display = MakeOffscreenDisplay(laparoscope, view_.render);
    laparoscope.SetSmoothEdges(true);  // As the node.
    laparoscope.SetTissue(moment.tissue.xyz);
    laparoscope.SetTopology(moment.topology);
    for (const TemperaturePatch& patch : moment.patches) {
      laparoscope.ApplyPatch(patch);
    }
    HudState hud;
    hud.session_time_s = moment.tissue.header.session_time_s;
    for (int tool = 0; tool < kMaxTools; ++tool) {
      const auto k = static_cast<std::size_t>(tool);
      laparoscope.SetTool(tool, moment.tools.tools[k]);
      laparoscope.SetJaw(tool, moment.handles.handles[k].jaw_angle_rad);
      if (moment.tools.tools[k].kind != ToolKind::kNone) hud.force_N[k] = 0.4f;
    }
    laparoscope.SetTexts(HudTexts(hud, true));
    laparoscope.Update();
    if (change) {
      change(&laparoscope);
      laparoscope.Update();
    }
    Bitmap picture;
    display->DrawAndRead(&picture);
    return Reduced(picture);
  }

  static void ExpectAsBefore(const char* name, const Bitmap& picture) {
    const std::filesystem::path file = std::filesystem::path(FULCRUM_GOLDEN_DIR) / (std::string(name) + ".png");
    const std::filesystem::path now = std::filesystem::path(testing::TempDir()) / (std::string(name) + ".png");
    WritePng(picture, now);
    ASSERT_TRUE(std::filesystem::exists(file)) << "no " << file << "; look at " << now;
    const Difference difference = Compare(picture, ReadPng(file));
    EXPECT_FALSE(difference.visible()) << name << ": a block differs by " << difference.worst_block
                                       << " of 255, the mean by " << difference.mean << "; look at " << now;
  }

  /// View of a scope with a narrow field at the middle of the cut: triangles of the mesh are 30 pixels large.
  void LookClose() {
    const SyntheticMoment moment = MakeSyntheticMoment(view_, 14.0);
    LaparoscopeView laparoscope(view_);
    laparoscope.SetTissue(moment.tissue.xyz);
    laparoscope.Update();
    view_.render.scope_target_W = laparoscope.OnMembrane(moment.cut_path[moment.cut_path.size() / 2]);
    view_.render.fov_deg = 10;
  }

  static Bitmap Golden(const char* name) {
    return ReadPng(std::filesystem::path(FULCRUM_GOLDEN_DIR) / (std::string(name) + ".png"));
  }

  const scene::SceneData data_;
  SceneView view_;
};

TEST_F(GoldenTest, AtRest) { ExpectAsBefore("at_rest", Draw(MakeSyntheticMoment(view_, 0.5))); }

TEST_F(GoldenTest, Pulled) { ExpectAsBefore("pulled", Draw(MakeSyntheticMoment(view_, 6.0))); }

TEST_F(GoldenTest, CutOpen) { ExpectAsBefore("cut_open", Draw(MakeSyntheticMoment(view_, 14.0))); }

TEST_F(GoldenTest, CutSeenClose) {
  LookClose();
  ExpectAsBefore("cut_close", Draw(MakeSyntheticMoment(view_, 14.0)));
}

TEST_F(GoldenTest, TheShaderOfUntouchedTissueDrawsWhatTheOtherOneDoes) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 12.0);
  OneShader one;
  const Bitmap whole = Draw(moment, [&](LaparoscopeView* view) { view->root()->accept(one); });
  EXPECT_GT(one.found, 2);
  ASSERT_TRUE(one.touched);
  const Bitmap picture = Draw(moment);
  int worst = 0;
  for (std::size_t k = 0; k < whole.rgb.size(); ++k) {
    worst = std::max(worst, std::abs(int{whole.rgb[k]} - int{picture.rgb[k]}));
  }
  EXPECT_LE(worst, 2);
}

TEST_F(GoldenTest, BurningWithSmoke) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 10.0);
  ExpectAsBefore("burning", Draw(moment, [&](LaparoscopeView* view) {
                   for (int k = 0; k < 12; ++k) {
                     view->AddSmoke(moment.cut_path.back(), 9.0 + 0.1 * k);
                   }
                   EXPECT_TRUE(view->UpdateEffects(10.2));
                 }));
}

TEST_F(GoldenTest, Bleeding) {
  SyntheticMoment moment = MakeSyntheticMoment(view_, 12.0);
  for (TemperaturePatch& patch : moment.patches) {  // Cut without any coagulation.
    for (std::size_t k = 0; k < patch.texels.size(); k += 4) {
      patch.texels[k + 1] = patch.texels[k + 2] = 0;
    }
  }
  ExpectAsBefore("bleeding", Draw(moment, [&](LaparoscopeView* view) {
                   for (const Vec2f& place : moment.cut_path) {
                     view->OpenVessels(place, 12.0);
                   }
                   for (int k = 0; k < 30; ++k) {
                     view->UpdateEffects(12.0 + 0.1 * k);
                   }
                 }));
}

TEST_F(GoldenTest, Clipped) {
  view_.tools[kApplier] = scene::DefaultTool(ToolKind::kClipApplier, Vec3f(0.045f, -0.075f, 0.085f));
  const ClippedMoment clipped = MakeClippedMoment(view_);
  ASSERT_EQ(clipped.clips.size(), 2u);
  view_.render.scope_target_W = clipped.between_W - Vec3f(0, 0, 0.003f);
  view_.render.fov_deg = 15;
  const auto apply = [&](LaparoscopeView* view) {
    view->SetClips(clipped.clips);
    (void)view->UpdateEffects(0.5);  // The vessel between them has no supply.
  };
  ExpectAsBefore("clipped", Draw(clipped.moment, apply));
  const Difference difference = Compare(Draw(clipped.moment), Golden("clipped"));
  EXPECT_GT(difference.worst_block, 3 * kWorstBlock) << "clips that are missing are seen";
}

TEST_F(GoldenTest, WarningShown) {
  HudState hud;
  hud.session_time_s = 8.0;
  hud.pedals = kPedalCut;
  hud.power_W = 35;
  hud.force_N = {0.8f, 2.1f};
  hud.force_limit_N = 3.3f;
  hud.tip_C = 100;
  hud.slit_m = 0.012f;
  hud.ureter = Alarm::kHot;
  hud.nerve = Alarm::kInjured;
  hud.late = {"TISSUE HELD"};
  ExpectAsBefore("warning", Draw(MakeSyntheticMoment(view_, 8.0),
                                 [&](LaparoscopeView* view) { view->SetTexts(HudTexts(hud, true)); }));
}

TEST_F(GoldenTest, ASlitThatDisappearsIsSeen) {
  SyntheticMoment moment = MakeSyntheticMoment(view_, 14.0);
  std::fill(moment.topology.dead_edges.begin(), moment.topology.dead_edges.end(), std::uint8_t{0});
  for (TemperaturePatch& patch : moment.patches) {
    for (std::size_t k = 3; k < patch.texels.size(); k += 4) {
      patch.texels[k] = 255;
    }
  }
  const Difference difference = Compare(Draw(moment), Golden("cut_open"));
  EXPECT_GT(difference.worst_block, 3 * kWorstBlock);
}

TEST_F(GoldenTest, AnOpaqueMembraneIsSeen) {
  const Bitmap picture = Draw(MakeSyntheticMoment(view_, 0.5), [](LaparoscopeView* view) {
    Opaque opaque;
    view->root()->accept(opaque);
    EXPECT_EQ(opaque.found, 1);
  });
  const Difference difference = Compare(picture, Golden("at_rest"));
  EXPECT_GT(difference.worst_block, 3 * kWorstBlock);
}

TEST_F(GoldenTest, AShadowThatIsMissingIsSeen) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 6.0);
  const Bitmap picture = Draw(moment, [](LaparoscopeView* view) {
    Remove shadow("shadow");
    view->root()->accept(shadow);
    EXPECT_EQ(shadow.found, 1);
  });
  EXPECT_TRUE(Compare(picture, Golden("pulled")).visible());
}

TEST_F(GoldenTest, AMembraneOfOneLayerIsSeen) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 0.5);
  for (const char* layer : {"upper", "lower"}) {
    const std::string name(layer);
    const Bitmap picture = Draw(moment, [&](LaparoscopeView* view) {
      Rewrite gone("bool from_above", name + ".a = 0.0;\n  bool from_above");
      view->root()->accept(gone);
      EXPECT_EQ(gone.found, 1);
    });
    EXPECT_TRUE(Compare(picture, Golden("at_rest")).visible()) << layer;
  }
}

// Both layers half opaque, the peritoneum red and the fascia green: the nearer layer contributes twice as much.
TEST_F(GoldenTest, TheNearerLayerOfTheMembraneLiesOnTop) {
  SyntheticMoment above = MakeSyntheticMoment(view_, 0.5);
  above.tools = {};
  SyntheticMoment beneath = above;  // The sheet turned over, left to right.
  const Index first = view_.membrane.first;
  const float middle = view_.render.scope_target_W.x();
  for (std::size_t i = first; i < view_.rest_position.size(); ++i) {
    beneath.tissue.xyz[3 * i] = 2 * middle - beneath.tissue.xyz[3 * i];
  }
  for (const bool reversed : {false, true}) {
    for (const bool from_above : {true, false}) {
      const Bitmap picture = Draw(from_above ? above : beneath, [&](LaparoscopeView* view) {
        Rewrite paint("bool from_above",
                      "wet = 0.0;\n  upper = vec4(1.0, 0.0, 0.0, 0.5);\n  lower = vec4(0.0, 1.0, 0.0, 0.5);\n"
                      "  bool from_above");
        view->root()->accept(paint);
        EXPECT_EQ(paint.found, 1);
        if (reversed) {
          ReverseTriangles reverse;
          view->root()->accept(reverse);
          EXPECT_EQ(reverse.found, 1);
        }
      });
      double red = 0, green = 0;
      for (int y = picture.height / 2 - 10; y < picture.height / 2 + 10; ++y) {
        for (int x = picture.width / 2 - 10; x < picture.width / 2 + 10; ++x) {
          const std::size_t pixel = 3 * TexelIndex(x, y, picture.width);
          red += picture.rgb[pixel];
          green += picture.rgb[pixel + 1];
        }
      }
      // The tissue beneath the membrane is red in both cases: a quarter of it shines through.
      EXPECT_GT(green, 20 * 400) << "no fascia";
      if (from_above) {
        EXPECT_GT(red, 1.25 * green) << "reversed " << reversed;
      } else {
        EXPECT_LT(red, 1.05 * green) << "reversed " << reversed;
      }
    }
  }
}

TEST_F(GoldenTest, ACutOfMissingTrianglesIsSeen) {
  LookClose();
  SyntheticMoment moment = MakeSyntheticMoment(view_, 14.0);
  for (TemperaturePatch& patch : moment.patches) {
    for (std::size_t k = 3; k < patch.texels.size(); k += 4) {
      patch.texels[k] = 255;
    }
  }
  for (Index node = 0; node < view_.membrane.node_count(); ++node) {
    for (std::size_t direction = 0; direction < 3; ++direction) {
      if (TestBit(moment.topology.dead_edges, 3 * std::size_t{node} + direction)) {
        SetBit(moment.topology.dead_nodes, node);
      }
    }
  }
  const Difference difference = Compare(Draw(moment), Golden("cut_close"));
  EXPECT_GT(difference.worst_block, 3 * kWorstBlock);
}

}  // namespace
}  // namespace fulcrum::render
