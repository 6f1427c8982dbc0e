// Colours of pictures of the small scene at known places.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <osg/Camera>
#include <osg/NodeVisitor>
#include <osg/observer_ptr>
#include <vector>

#include "render_node/geometry/solid.h"
#include "render_node/offscreen/png_writer.h"
#include "render_node/scene_graph/cut_layer.h"
#include "render_node/scene_graph/display.h"
#include "render_node/scene_graph/drawn_surfaces.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {
namespace {

struct Rgb {
  double r = 0, g = 0, b = 0;
};

class PictureTest : public testing::Test {
 protected:
  PictureTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {}

  void Apply(const SyntheticMoment& moment, bool with_patches, LaparoscopeView* laparoscope) const {
    laparoscope->SetTissue(moment.tissue.xyz);
    laparoscope->SetTopology(moment.topology);
    if (with_patches) {
      for (const TemperaturePatch& patch : moment.patches) {
        laparoscope->ApplyPatch(patch);
      }
    }
    laparoscope->Update();
  }

  /// Draws the tissue alone, without instruments in front of it.
  Bitmap Draw(const std::function<void(LaparoscopeView*)>& change) const {
    LaparoscopeView laparoscope(view_);
    const auto display = MakeOffscreenDisplay(laparoscope, view_.render);
    change(&laparoscope);
    laparoscope.Update();
    Bitmap picture;
    display->DrawAndRead(&picture);
    return picture;
  }

  /// Mean colour of a square of 2 * reach + 1 pixels a side around the image of p_W.
  Rgb At(const Bitmap& picture, const Vec3f& p_W, int reach = 2) const {
    const Laparoscope scope = MakeLaparoscope(view_.render);
    const Vec3f clip = (scope.projection * scope.view * p_W.homogeneous()).hnormalized();
    const int x = static_cast<int>((0.5f + 0.5f * clip.x()) * static_cast<float>(picture.width));
    const int y = static_cast<int>((0.5f + 0.5f * clip.y()) * static_cast<float>(picture.height));
    EXPECT_TRUE(x > 2 && y > 2 && x < picture.width - 3 && y < picture.height - 3) << "not in the picture";
    Rgb mean;
    const double pixels = (2 * reach + 1) * (2 * reach + 1);
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        const std::uint8_t* pixel =
            picture.rgb.data() + 3 * (static_cast<std::size_t>(y + dy) * static_cast<std::size_t>(picture.width) +
                                      static_cast<std::size_t>(x + dx));
        mean.r += pixel[0] / pixels;
        mean.g += pixel[1] / pixels;
        mean.b += pixel[2] / pixels;
      }
    }
    return mean;
  }

  static double MeanDifference(const Bitmap& a, const Bitmap& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) {
      sum += std::abs(int{a.rgb[i]} - int{b.rgb[i]});
    }
    return sum / static_cast<double>(a.rgb.size());
  }

  /// Position of the middle of the cut in the picture.
  static Vec3f MiddleOfCut(const LaparoscopeView& laparoscope, const SyntheticMoment& moment) {
    return laparoscope.OnMembrane(moment.cut_path[moment.cut_path.size() / 2]);
  }

  const scene::SceneData data_;
  const SceneView view_;
};

TEST_F(PictureTest, ShowsPinkTissueInARoundField) {
  const Bitmap picture = Draw([](LaparoscopeView*) {});
  const auto pixel = [&](int x, int y) {
    return picture.rgb.data() + 3 * static_cast<std::size_t>(y * picture.width + x);
  };
  for (const int x : {0, picture.width - 1}) {
    for (const int y : {0, picture.height - 1}) {
      EXPECT_EQ(pixel(x, y)[0], 0) << "the corner at " << x << ", " << y << " lies outside the optics";
    }
  }
  const Rgb middle = At(picture, view_.render.scope_target_W);
  EXPECT_GT(middle.r, 90);
  EXPECT_GT(middle.r, 1.15 * middle.g);
  EXPECT_GT(middle.r, 1.15 * middle.b);
}

/// A data set of a hundred variations builds a hundred views, and a film one for each step back.
TEST_F(PictureTest, LeavesNothingBehind) {
  class Cameras : public osg::NodeVisitor {
   public:
    Cameras() : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN) { setNodeMaskOverride(~0u); }  // They rest when drawn.
    void apply(osg::Camera& camera) override {
      found.emplace_back(&camera);
      traverse(camera);
    }
    std::vector<osg::observer_ptr<osg::Camera>> found;
  } cameras;
  {
    LaparoscopeView laparoscope(view_);
    const auto display = MakeOffscreenDisplay(laparoscope, view_.render);
    Bitmap picture;
    display->DrawAndRead(&picture);
    laparoscope.root()->accept(cameras);
  }
  EXPECT_GE(cameras.found.size(), 2u);
  for (const auto& camera : cameras.found) EXPECT_FALSE(camera.valid());
}

TEST_F(PictureTest, IsTheSameEveryTime) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 4.5);
  const auto draw = [&] { return Draw([&](LaparoscopeView* l) { Apply(moment, true, l); }); };
  const Bitmap first = draw(), second = draw();
  // One rasteriser on one machine: all pixels are equal. Between machines rounding may move an edge by a pixel.
  EXPECT_EQ(first.rgb, second.rgb);
}

TEST_F(PictureTest, OfACameraThatComesBackIsTheSame) {
  RenderParams other = view_.render, brighter = view_.render;
  other.scope_tip_W += Vec3f(0.005f, 0, 0);
  brighter.scope_target_W += view_.render.scope_target_W - view_.render.scope_tip_W;  // Light for twice the distance.
  LaparoscopeView laparoscope(view_);
  const auto display = MakeOffscreenDisplay(laparoscope, view_.render);
  const auto draw = [&](const RenderParams& camera) {
    laparoscope.SetCamera(camera);
    laparoscope.Update();
    Bitmap picture;
    display->DrawAndRead(&picture);
    return picture.rgb;
  };
  const auto surfaces = DrawnSurfaces(laparoscope.root()).size();
  const auto first = draw(view_.render), second = draw(other);
  EXPECT_NE(first, second);
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(draw(view_.render), first);
    EXPECT_EQ(draw(other), second);
  }
  const auto third = draw(brighter);
  EXPECT_NE(third, first) << "the same place with another light";
  laparoscope.SetCamera(view_.render);  // No picture is drawn from here.
  EXPECT_EQ(draw(other), second);
  EXPECT_EQ(draw(brighter), third);
  EXPECT_EQ(draw(view_.render), first);
  EXPECT_EQ(DrawnSurfaces(laparoscope.root()).size(), surfaces) << "also of cameras that rest";
}

TEST_F(PictureTest, TheMembraneIsHalfTransparent) {
  const Bitmap with = Draw([](LaparoscopeView*) {});
  // The same without the membrane: every texel of the atlas is removed.
  const Bitmap without = Draw([&](LaparoscopeView* l) {
    TemperaturePatch gone;
    gone.texels.assign(4u * kPatchTexels * kPatchTexels, 0);
    for (std::uint32_t y = 0; y < 8; ++y) {
      for (std::uint32_t x = 0; x < 8; ++x) {
        gone.header.origin_x = x * kPatchTexels;
        gone.header.origin_y = y * kPatchTexels;
        l->ApplyPatch(gone);
      }
    }
  });
  const double difference = MeanDifference(with, without);
  EXPECT_GT(difference, 1.0) << "the membrane cannot be seen";
  EXPECT_LT(difference, 40.0) << "the membrane hides what lies beneath";
  EXPECT_GT(At(without, view_.render.scope_target_W).r, 60) << "nothing lies beneath the membrane";
}

TEST_F(PictureTest, ABurntSolidIsSeenAndAnIntactPatchChangesNothing) {
  const auto with_texels = [&](const std::array<std::uint8_t, 4>& texel) {
    TemperaturePatch patch;
    patch.header.surface = BurntSurface::kSolids;
    for (int i = 0; i < kPatchTexels * kPatchTexels; ++i) {
      patch.texels.insert(patch.texels.end(), texel.begin(), texel.end());
    }
    return Draw([&](LaparoscopeView* l) {
      for (std::uint32_t y = 0; y < 4; ++y) {
        for (std::uint32_t x = 0; x < 4; ++x) {
          patch.header.origin_x = x * kPatchTexels;
          patch.header.origin_y = y * kPatchTexels;
          l->ApplyPatch(patch);
        }
      }
    });
  };
  const Bitmap intact = with_texels({34, 0, 0, 255});
  EXPECT_EQ(intact.rgb, Draw([](LaparoscopeView*) {}).rgb);
  // Through the membrane, which is half transparent.
  EXPECT_GT(MeanDifference(intact, with_texels({34, 255, 255, 255})), 1.0);
}

TEST_F(PictureTest, ASlitShowsFatBetweenBrownedEdges) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  ASSERT_GE(moment.cut_path.size(), 3u);
  SyntheticMoment uncut = moment;
  std::fill(uncut.topology.dead_edges.begin(), uncut.topology.dead_edges.end(), std::uint8_t{0});
  LaparoscopeView geometry(view_);
  Apply(moment, true, &geometry);
  const Vec3f middle = MiddleOfCut(geometry, moment);
  const Bitmap cut = Draw([&](LaparoscopeView* l) { Apply(moment, true, l); });
  const Bitmap intact = Draw([&](LaparoscopeView* l) { Apply(uncut, false, l); });
  // Fat is yellow: less blue against red than the membrane over it.
  const Rgb slit = At(cut, middle), sheet = At(intact, middle);
  EXPECT_LT(slit.b / slit.r, 0.85 * sheet.b / sheet.r);
  // Somewhere between the slit and 5 mm beside it, where its lip has drawn back to, the picture is much darker than the
  // uncut sheet.
  double darkest = 1;
  for (float beside = 0; beside < 0.005f; beside += 0.0001f) {
    const Vec3f p = middle + Vec3f(beside, 0, 0);
    darkest = std::min(darkest, At(cut, p, 1).r / At(intact, p, 1).r);
  }
  EXPECT_LT(darkest, 0.75);
}

TEST_F(PictureTest, OfACutDoesNotDependOnWhetherTopologyOrPatchesCameFirst) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  const Bitmap first = Draw([&](LaparoscopeView* l) { Apply(moment, true, l); });
  const Bitmap second = Draw([&](LaparoscopeView* l) {
    for (const TemperaturePatch& patch : moment.patches) l->ApplyPatch(patch);
    Apply(moment, false, l);
  });
  EXPECT_EQ(first.rgb, second.rgb);
}

TEST_F(PictureTest, LipsAreThereFromTheFirstCutOnAndMadeAnewOnlyAfterAChange) {
  const auto lips = [](LaparoscopeView* laparoscope) {
    const auto surfaces = DrawnSurfaces(laparoscope->root());
    return std::ranges::count_if(surfaces, [](const DrawnSurface& s) { return s.name == "cut"; });
  };
  SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  LaparoscopeView laparoscope(view_);
  Apply(MakeSyntheticMoment(view_, 0.5), true, &laparoscope);
  EXPECT_EQ(lips(&laparoscope), 0);
  Apply(moment, true, &laparoscope);
  EXPECT_EQ(lips(&laparoscope), 1);

  Atlas atlas(view_);
  MembraneMesh mesh(view_);
  FieldOfView field(std::array{MakeLaparoscope(view_.render)});
  const osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  CutLayer layer(view_);
  const auto update = [&](bool recut, bool moved) {
    return layer.Update(atlas, mesh, recut, moved, Vec3f(0, 0, 0.1f), 700, &field, geode);
  };
  EXPECT_FALSE(update(true, true));
  EXPECT_EQ(geode->getNumDrawables(), 0u);
  mesh.SetTopology(moment.topology);
  mesh.Update(moment.tissue.xyz);
  for (const TemperaturePatch& patch : moment.patches) atlas.Apply(patch);
  EXPECT_TRUE(update(true, true));
  EXPECT_EQ(geode->getNumDrawables(), 1u);
  EXPECT_FALSE(update(false, false)) << "at rest nothing is made";
  EXPECT_TRUE(update(false, true));
  ASSERT_FALSE(moment.patches.empty());
  for (const TemperaturePatch& patch : moment.patches) atlas.Apply(patch);
  EXPECT_FALSE(update(false, false)) << "a patch that changes no damage changes no lip";
  for (TemperaturePatch patch : moment.patches) {
    for (std::size_t k = 1; k < patch.texels.size(); k += 4) patch.texels[k] = 255;
    atlas.Apply(patch);
  }
  EXPECT_TRUE(update(false, false)) << "it is burnt further";
}

TEST_F(PictureTest, InThePapersModelColourFollowsTheTemperatureOfTheMoment) {
  SceneView paper = view_;
  paper.thermal.model = ThermalModel::kPaper;
  SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  for (TemperaturePatch& patch : moment.patches) {
    for (std::size_t k = 0; k < patch.texels.size(); k += 4) {
      patch.texels[k] = 150;  // 95 degrees, without damage or dryness.
      patch.texels[k + 1] = patch.texels[k + 2] = 0;
      patch.texels[k + 3] = 255;
    }
  }
  std::fill(moment.topology.dead_edges.begin(), moment.topology.dead_edges.end(), std::uint8_t{0});
  std::vector<Rgb> middles;
  for (const SceneView& scene : {view_, paper}) {
    LaparoscopeView laparoscope(scene);
    const auto display = MakeOffscreenDisplay(laparoscope, scene.render);
    Apply(moment, true, &laparoscope);
    Bitmap picture;
    display->DrawAndRead(&picture);
    middles.push_back(At(picture, MiddleOfCut(laparoscope, moment)));
  }
  EXPECT_LT(middles[1].r, 0.8 * middles[0].r) << "brown by eq. 15";
}

/// Eq. 15 to the letter: up to v = 0.95 tissue is seen, brown; above, what lies beneath.
TEST_F(PictureTest, AsPrintedHotTissueIsInvisible) {
  SceneView printed = view_;
  printed.thermal.model = ThermalModel::kPaper;
  printed.thermal.as = PaperForm::kPrinted;
  SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  std::fill(moment.topology.dead_edges.begin(), moment.topology.dead_edges.end(), std::uint8_t{0});
  LaparoscopeView laparoscope(printed);
  const auto display = MakeOffscreenDisplay(laparoscope, printed.render);
  const auto green = [&](std::uint8_t heat) {
    for (TemperaturePatch& patch : moment.patches) {
      for (std::size_t k = 0; k < patch.texels.size(); k += 4) {
        patch.texels[k] = heat;
        patch.texels[k + 1] = patch.texels[k + 2] = 0;
        patch.texels[k + 3] = 255;
      }
    }
    Apply(moment, true, &laparoscope);
    Bitmap picture;
    display->DrawAndRead(&picture);
    return At(picture, MiddleOfCut(laparoscope, moment)).g;
  };
  constexpr std::uint8_t kBrown = 150, kAbove = 156, kVaporised = 165;  // 95, 98 and 102 degrees.
  const double brown = green(kBrown), above = green(kAbove), gone = green(kVaporised);
  EXPECT_GT(brown, gone + 20);
  EXPECT_NEAR(above, gone, 6);
}

TEST_F(PictureTest, ARestartedRendererShowsTheCutFromTheTopologyAlone) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 4.8);
  const Bitmap known = Draw([&](LaparoscopeView* l) { Apply(moment, true, l); });
  const Bitmap rebuilt = Draw([&](LaparoscopeView* l) { Apply(moment, false, l); });
  SyntheticMoment uncut = moment;
  std::fill(uncut.topology.dead_edges.begin(), uncut.topology.dead_edges.end(), std::uint8_t{0});
  const Bitmap intact = Draw([&](LaparoscopeView* l) { Apply(uncut, false, l); });
  LaparoscopeView geometry(view_);
  Apply(moment, true, &geometry);
  const Vec3f middle = MiddleOfCut(geometry, moment);
  // The strongest change within 3 mm of the cut's middle: the topology resolves the place only to half a cell of the
  // grid.
  const auto change = [&](const Bitmap& picture) {
    double most = 0;
    for (float beside = -0.003f; beside < 0.003f; beside += 0.0002f) {
      const Rgb a = At(picture, middle + Vec3f(beside, 0, 0)), b = At(intact, middle + Vec3f(beside, 0, 0));
      most = std::max(most, std::hypot(a.r - b.r, a.g - b.g, a.b - b.b));
    }
    return most;
  };
  EXPECT_GT(change(known), 40);
  EXPECT_GT(change(rebuilt), 40);
}

TEST_F(PictureTest, InstrumentsAreDrawnWhereTheirTipsAreAndJawsOpen) {
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 0.0);
  const Bitmap none = Draw([&](LaparoscopeView* l) { Apply(moment, false, l); });
  const auto with_jaw = [&](float angle) {
    return Draw([&](LaparoscopeView* l) {
      Apply(moment, false, l);
      ToolSample sample = moment.tools.tools[0];
      sample.p_WT = view_.render.scope_target_W + Vec3f(0, 0, 0.012f);
      l->SetTool(0, sample);
      l->SetJaw(0, angle);
    });
  };
  const Bitmap closed = with_jaw(0), open = with_jaw(0.9f);
  EXPECT_GT(MeanDifference(none, closed), 0.2);
  EXPECT_GT(MeanDifference(closed, open), 0.05);
}

// Meshes with the grasper's own shape are drawn like the grasper; jaws open by the same angle.
TEST_F(PictureTest, MeshesOfTheSceneAreDrawnInPlaceOfAnInstrument) {
  const ToolDescription& tool = view_.tools[0];
  const ToolShape shape{tool.shaft_radius_m, tool.shaft_length_m, tool.tip_radius_m, tool.tip_length_m};
  scene::SceneData with_meshes = data_;
  const auto add = [&](ToolPart part, const Solid& solid, const Mat3f& turn, float z) {
    const auto first = static_cast<Index>(with_meshes.tool_vertices.size());
    with_meshes.tool_meshes.push_back({0, part, first, static_cast<Index>(solid.positions.size()),
                                       static_cast<Index>(with_meshes.tool_triangles.size()),
                                       static_cast<Index>(solid.triangles.size())});
    for (const Vec3f& p : solid.positions) {
      with_meshes.tool_vertices.emplace_back(turn * p + Vec3f(0, 0, z));
    }
    for (const Triangle& t : solid.triangles) {
      with_meshes.tool_triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
  };
  const Mat3f half_turn = Vec3f(-1, -1, 1).asDiagonal();
  add(ToolPart::kBody, GrasperShaft(shape), Mat3f::Identity(), 0);
  add(ToolPart::kJawPlus, GrasperJaw(shape), Mat3f::Identity(), -tool.tip_length_m);
  add(ToolPart::kJawMinus, GrasperJaw(shape), half_turn, -tool.tip_length_m);
  const SceneView mesh_view = with_meshes.View();
  const SyntheticMoment moment = MakeSyntheticMoment(view_, 0.0);
  // The grey area of the picture: nothing of the body is grey.
  const auto outline = [&](const SceneView& scene, float angle) {
    LaparoscopeView laparoscope(scene);
    const auto display = MakeOffscreenDisplay(laparoscope, scene.render);
    ToolSample sample = moment.tools.tools[0];
    sample.p_WT = scene.render.scope_target_W + Vec3f(0, 0, 0.012f);
    laparoscope.SetTool(0, sample);
    laparoscope.SetJaw(0, angle);
    laparoscope.Update();
    Bitmap picture;
    display->DrawAndRead(&picture);
    std::vector<bool> covered;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
      covered.push_back(picture.rgb[i + 2] > 0.9 * picture.rgb[i]);
    }
    return covered;
  };
  const auto differing = [](const std::vector<bool>& a, const std::vector<bool>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0, std::plus<>(), std::not_equal_to<>());
  };
  const auto open = outline(view_, 0.9f), mesh_open = outline(mesh_view, 0.9f), mesh_closed = outline(mesh_view, 0);
  EXPECT_GT(differing(mesh_open, mesh_closed), 50);
  EXPECT_LT(differing(open, mesh_open), 0.2 * differing(mesh_open, mesh_closed));
}

TEST_F(PictureTest, TheTentMovesThePicture) {
  const SyntheticMoment rest = MakeSyntheticMoment(view_, 0.0), lifted = MakeSyntheticMoment(view_, 2.2);
  const Bitmap before = Draw([&](LaparoscopeView* l) { Apply(rest, false, l); });
  const Bitmap after = Draw([&](LaparoscopeView* l) { Apply(lifted, false, l); });
  EXPECT_GT(MeanDifference(before, after), 0.5);
}

TEST(PngTest, RoundTripsAndNamesTheFileThatCannotBeWritten) {
  Bitmap picture{3, 2, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18}};
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "round_trip.png";
  WritePng(picture, file);
  EXPECT_EQ(ReadPng(file).rgb, picture.rgb);
  std::filesystem::remove(file);
  try {
    WritePng(picture, "/nonexistent/picture.png");
    FAIL() << "wrote into a folder that is not there";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/picture.png"), std::string::npos);
  }
}

}  // namespace
}  // namespace fulcrum::render
